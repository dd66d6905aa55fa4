// A loss coefficient m_2B(mu, v) on a grid, linear on triangles: the law that a loss map and the walk of a batch share.
//
// The text of this file is plain: it includes nothing, allocates nothing and calls nothing, so that it is also a part
// of the body of a kernel for graphics processors. `real` is the type of its numbers, defined where it is included.

// Loss coefficient m_2B = at_zero + per_speed * v + per_load * mu.
struct Plane {
    real at_zero = 0, per_speed = 0, per_load = 0;
};

// The half plane at_zero + per_speed * v + per_load * mu >= 0 that bounds a triangle, and what lies beyond it.
struct Edge {
    Plane inside;
    int neighbour = -1;  // triangle on the other side; -1: the end of the extended map
};

struct LossGrid {
    const real *speeds, *loads, *values;  // values[j * n_speeds + i] at (loads[j], speeds[i])
    int n_speeds, n_loads;

    int cells_along_speed() const { return n_speeds - 1; }
    int load_intervals() const { return n_loads - 1; }
    real value(int j, int i) const { return values[j * n_speeds + i]; }
    // Is this node that of no load at standstill, and without loss?
    bool no_loss_at_origin(int j, int i) const { return loads[j] == 0 && speeds[i] == 0 && value(j, i) == 0; }
    // Diagonals rise for mu > 0 and fall for mu < 0, so that a map mirrored in its data is mirrored in its triangles.
    bool rising(int j) const { return loads[j] + loads[j + 1] >= 0; }

    static int interval(const real* axis, int n, real at) {
        int k = 0;
        while (k + 2 < n && at > axis[k + 1]) ++k;
        return k;
    }
    // Number of the triangle that contains (mu, v); on an edge, one of its two.
    int triangle(real mu, real v) const {
        const int i = interval(speeds, n_speeds, v), j = interval(loads, n_loads, mu);
        const real s = (v - speeds[i]) / (speeds[i + 1] - speeds[i]);
        const real r = (mu - loads[j]) / (loads[j + 1] - loads[j]);
        const bool upper = rising(j) ? r > s : r > 1 - s;
        return 2 * (j * cells_along_speed() + i) + (upper ? 1 : 0);
    }
    // Number of the interval of the load axis that contains mu: the cells of the line v = 0.
    int load_interval(real mu) const { return interval(loads, n_loads, mu); }

    Plane plane(int triangle) const {
        const int cell = triangle / 2, i = cell % cells_along_speed(), j = cell / cells_along_speed();
        const bool upper = triangle % 2 == 1;
        const real dv = speeds[i + 1] - speeds[i], dm = loads[j + 1] - loads[j];
        // The triangle has a whole side along v (at the top or the bottom) and one along mu (left or right).
        const int row = upper ? j + 1 : j;
        const int column = rising(j) == upper ? i : i + 1;
        Plane p;
        p.per_speed = (value(row, i + 1) - value(row, i)) / dv;
        p.per_load = (value(j + 1, column) - value(j, column)) / dm;
        p.at_zero = value(row, column) - p.per_speed * speeds[column] - p.per_load * loads[row];
        // Without load at standstill, rounding must not leave a loss where there is none: nothing else may hold.
        const int far_row = upper ? j : j + 1, far_column = rising(j) == upper ? i + 1 : i;
        if (no_loss_at_origin(row, far_column) || no_loss_at_origin(far_row, column)) p.at_zero = 0;
        return p;
    }
    // On the line v = 0, as a function of mu alone.
    Plane line_at_standstill(int j) const {
        Plane p;
        p.per_load = (value(j + 1, 0) - value(j, 0)) / (loads[j + 1] - loads[j]);
        p.at_zero = no_loss_at_origin(j + 1, 0) ? 0 : value(j, 0) - p.per_load * loads[j];
        return p;
    }

    // The edges of a triangle, without the one on v = 0 (that is the sign of the speed, not an edge of the map).
    // Returns their number (at most 3).
    int edges(int triangle, Edge out[3]) const {
        const int cell = triangle / 2, n = cells_along_speed(), i = cell % n, j = cell / n;
        const bool upper = triangle % 2 == 1, up = rising(j);
        int count = 0;
        // Across the diagonal: r - s (rising) or r + s - 1 (falling), positive in the upper triangle.
        const real dv = speeds[i + 1] - speeds[i], dm = loads[j + 1] - loads[j];
        Plane diagonal;
        diagonal.per_load = 1 / dm;
        diagonal.per_speed = (up ? real(-1) : real(1)) / dv;
        diagonal.at_zero = -loads[j] / dm + (up ? speeds[i] : -speeds[i]) / dv - (up ? real(0) : real(1));
        if (!upper) diagonal = {-diagonal.at_zero, -diagonal.per_speed, -diagonal.per_load};
        out[count++] = {diagonal, triangle ^ 1};
        // Along v: the top of an upper triangle, the bottom of a lower one.
        if (upper)
            out[count++] = {{loads[j + 1] / dm, 0, -1 / dm}, j + 1 < load_intervals() ? 2 * (cell + n) : -1};
        else
            out[count++] = {{-loads[j] / dm, 0, 1 / dm}, j > 0 ? 2 * (cell - n) + 1 : -1};
        // Along mu: upper and rising, or lower and falling, touch the left side; the others the right.
        if (upper == up) {
            if (i > 0) out[count++] = {{-speeds[i] / dv, 1 / dv, 0}, 2 * (cell - 1) + (up ? 0 : 1)};
        } else {
            out[count++] = {{speeds[i + 1] / dv, -1 / dv, 0}, i + 1 < n ? 2 * (cell + 1) + (up ? 1 : 0) : -1};
        }
        return count;
    }
};
