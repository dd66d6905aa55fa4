// The lane of one drive, for `drive_series.hpp`. The text of this file is plain, too.
struct Lane {
    typedef real number;
    typedef bool mask;
    static bool any(bool on) { return on; }
};
