// The motion of a drive within a regime, as the Taylor series of its four states; of one drive or of several at once.
//
// The text of this file is plain, as that of `drive_walk.hpp`. Where it is included, `real` is the type of its numbers:
// a number of one drive, or a vector with a lane for each of several drives. `ROUNDING` is the rounding of a number.
// `Lane`, for one drive that of `drive_lane.hpp`, has the type `number` of what all drives share, the type `mask` of a
// comparison, and `any`, which tells whether a comparison holds in any lane. A lane has the same bits whatever the
// others do.

struct Magnitudes {
    static real magnitude(real v) { return v < 0 ? -v : v; }
    static real least(real a, real b) { return a < b ? a : b; }
    static real most(real a, real b) { return a > b ? a : b; }
};

// q, a, v, d as in `drive_walk.hpp`.
struct DrivePoint {
    real q, a, v, d;
};

// one + q q + a a + v v + d d
struct DriveForm {
    real one, q, a, v, d;
    real at(const DrivePoint& x) const { return one + (q * x.q + a * x.a) + (v * x.v + d * x.d); }
    // The sum of the magnitudes of its terms.
    real size(const DrivePoint& x) const {
        return Magnitudes::magnitude(one) + Magnitudes::magnitude(q * x.q) + Magnitudes::magnitude(a * x.a) +
               Magnitudes::magnitude(v * x.v) + Magnitudes::magnitude(d * x.d);
    }
    real along(const real* t) const { return (q * t[0] + a * t[1]) + (v * t[2] + d * t[3]); }
    void add(real s, const DriveForm& f) {
        one += s * f.one;
        q += s * f.q;
        a += s * f.a;
        v += s * f.v;
        d += s * f.d;
    }
};

struct DriveRates {
    DriveForm q, a, w, v;
    real twists;        // d' = twists v: 1 or 0
    real norm;          // bound on the matrix of the rates, in scales that balance twist and speed, torque and speed
    real per_q, per_d;  // these scales
};

struct DriveSeries : Magnitudes {
    enum { longest = 24 };
    typedef Lane::number number;
    real y[4][longest + 1];  // terms of q, a, v, d, in the share of its time
    real tail[4];            // of the terms beyond the cubic
    int degree;

    // Over a time s. reach: of a series of each degree |A| s up to which what lies beyond is below rounding; inverse:
    // 1/k.
    void expand(const DriveRates& r, const DrivePoint& x, real s, const number* reach, const number* inverse,
                int most_degree) {
        const real reached = r.norm * s;
        real q = s * r.q.at(x), a = s * r.a.at(x), v = r.twists * (a - s * r.w.at(x)), d = r.twists * s * x.v;
        y[0][0] = x.q;
        y[1][0] = x.a;
        y[2][0] = x.v;
        y[3][0] = x.d;
        y[0][1] = q;
        y[1][1] = a;
        y[2][1] = v;
        y[3][1] = d;
        for (int c = 0; c < 4; ++c) tail[c] = real{};
        const real enough =
            number(0.0625) * ROUNDING *
            most(most(magnitude(q) * r.per_q, magnitude(d) * r.per_d), most(magnitude(a), magnitude(v)));
        // The k-th derivative times s^k, and 1/k!: a chain of products of the matrix alone is the shortest.
        const real qq = s * r.q.q, qa = s * r.q.a, aq = s * r.a.q, aa = s * r.a.a, av = s * r.a.v, ad = s * r.a.d,
                   vq = s * r.v.q, va = s * r.v.a, vv = s * r.v.v, vd = s * r.v.d, dv = r.twists * s;
        number share = 1;
        int k = 2;
        for (;; ++k) {
            const real next_q = qq * q + qa * a;
            const real next_a = (aq * q + aa * a) + (av * v + ad * d);
            const real next_v = (vq * q + va * a) + (vv * v + vd * d);
            d = dv * v;
            q = next_q;
            a = next_a;
            v = next_v;
            share *= inverse[k];
            y[0][k] = share * q;
            y[1][k] = share * a;
            y[2][k] = share * v;
            y[3][k] = share * d;
            if (k < 4) continue;
            for (int c = 0; c < 4; ++c) tail[c] += magnitude(y[c][k]);
            if (k == most_degree) break;
            // The terms beyond are bounded by this one and |A| s.
            Lane::mask on = reached > reach[k];
            if ((k & 1) == 0) {
                const real size = most(most(magnitude(y[0][k]) * r.per_q, magnitude(y[3][k]) * r.per_d),
                                       most(magnitude(y[1][k]), magnitude(y[2][k])));
                on = on & (reached * inverse[k + 1] * size > enough);
            }
            if (!Lane::any(on)) break;
            // What has all its terms goes on with zeros.
            q = on ? q : real{};
            a = on ? a : real{};
            v = on ? v : real{};
            d = on ? d : real{};
        }
        degree = k;
    }
    // To half of its time.
    void shorten() {
        number share = 1;
        for (int c = 0; c < 4; ++c) tail[c] = real{};
        for (int k = 0; k <= degree; ++k, share *= number(0.5))
            for (int c = 0; c < 4; ++c) {
                y[c][k] *= share;
                if (k > 3) tail[c] += magnitude(y[c][k]);
            }
    }
    // The state at the share `at` of the time s of the series. Returns by what the load has turned till then.
    real move(real s, real at, const number* inverse, DrivePoint& x) const {
        real sum[4], turned = (y[1][degree] - y[2][degree]) * inverse[degree + 1];
        for (int c = 0; c < 4; ++c) sum[c] = y[c][degree];
        for (int k = degree - 1; k >= 0; --k) {
            for (int c = 0; c < 4; ++c) sum[c] = at * sum[c] + y[c][k];
            turned = at * turned + (y[1][k] - y[2][k]) * inverse[k + 1];
        }
        x.q = sum[0];
        x.a = sum[1];
        x.v = sum[2];
        x.d = sum[3];
        return s * (at * turned);
    }

    // A form along the motion: a cubic and the most that the terms beyond it add.
    struct Cubic {
        real c[4], rest;
    };
    real term(const DriveForm& f, int k) const {
        return (f.q * y[0][k] + f.a * y[1][k]) + (f.v * y[2][k] + f.d * y[3][k]);
    }
    Cubic cubic(const DriveForm& f) const {
        Cubic out;
        for (int k = 0; k < 4; ++k) out.c[k] = term(f, k);
        out.c[0] += f.one;
        out.rest = (magnitude(f.q) * tail[0] + magnitude(f.a) * tail[1]) +
                   (magnitude(f.v) * tail[2] + magnitude(f.d) * tail[3]);
        return out;
    }
    // Whether a form is seen to stay above zero, by Bernstein coefficients.
    static Lane::mask stays_positive(const Cubic& f) {
        const number third = number(1) / 3;
        const real b1 = f.c[0] + third * f.c[1], b2 = b1 + third * (f.c[1] + f.c[2]),
                   b3 = (f.c[0] + f.c[1]) + (f.c[2] + f.c[3]);
        return least(least(f.c[0], b1), least(b2, b3)) > f.rest;
    }
};
