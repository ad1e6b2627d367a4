/* The baseline model of the fish as one plain C loop: what a person would write by hand.
 *
 * Same equations, parameter record and state rows as fish_env.model (see state.BASE_STATES and
 * packing.RECORD_FIELDS): classical Runge-Kutta, commands held, actuators ideal, no divergence
 * guard. Arrays are rows of n fish. A block of LANES fish is copied into local rows, so that the
 * compiler can put its fish side by side in vector registers; LANES = 1 is the scalar loop.
 */
#include <math.h>

#ifndef LANES
#define LANES 16
#endif
#define STATES 18
#define INPUTS 5
#define PARAMETERS 49
#define TWO_PI 6.283185307179586

typedef struct {
    double x[STATES][LANES];
    double slope[STATES][LANES];
    double input[INPUTS][LANES];
    double par[PARAMETERS][LANES];
} Block;

enum {
    DENSITY, GRAVITY, MASS, MASS_BUOYANCY, MASS_BLOCK, STATIC_X, STATIC_Y, STATIC_Z,
    REST_X, REST_Y, REST_Z, BLOCK_X, BLOCK_Y, BLOCK_Z, BRACKET_X, BRACKET_Y, BRACKET_Z,
    D1, D2, D3, S_W0, CRANK_L1, CRANK_L2, ROOT_X, ROOT_Y, ROOT_Z, TAIL_R_C, TAIL_AREA,
    TAIL_C0, TAIL_C2, TAIL_C1, AREA_X, AREA_Y, AREA_Z, XZ_C0, XZ_C2, XZ_C1, XZ_K,
    XY_C0, XY_C2, XY_C1, XY_K, DAMPING_X, DAMPING_Y, DAMPING_Z,
    INVERSE_MASS, REST_OB_X, REST_OB_Y, REST_OB_Z
};

static inline void sincos_of(double angle, double *sine_out, double *cosine_out)
{
    double turns = rint(angle * 0.6366197723675814);
    double x = ((angle - turns * 1.5707963267341256) - turns * 6.077100506303966e-11)
               - turns * 2.0222662487959506e-21;
    double y = x * x;
    double y2 = y * y, y4 = y2 * y2;
    double low = (y * (1.0 / 120.0) - 1.0 / 6.0) + y2 * (y * (1.0 / 362880.0) - 1.0 / 5040.0);
    double high = (y * (1.0 / 6227020800.0) - 1.0 / 39916800.0)
                  + y2 * (y * (1.0 / 355687428096000.0) - 1.0 / 1307674368000.0);
    double sine = x + (x * y) * (low + y4 * high);
    low = (y * (1.0 / 24.0) - 0.5) + y2 * (y * (1.0 / 40320.0) - 1.0 / 720.0);
    high = (y * (1.0 / 479001600.0) - 1.0 / 3628800.0)
           + y2 * (y * (1.0 / 20922789888000.0) - 1.0 / 87178291200.0);
    double cosine = 1.0 + y * (low + y4 * high);
    double quarter = turns - 4.0 * rint((turns - 1.5) * 0.25);
    int odd = (quarter == 1.0) | (quarter == 3.0);
    double first = odd ? cosine : sine;
    double second = odd ? sine : cosine;
    *sine_out = quarter >= 2.0 ? -first : first;
    *cosine_out = (quarter == 1.0) | (quarter == 2.0) ? -second : second;
}

static inline double inverse_of(double speed)
{
    return speed > 0.0 ? 1.0 / speed : 0.0;
}

/* d(state)/dt of lane k: rows x -> rows slope. */
static inline void derivative(Block *restrict b, int k)
{
#define P(name) b->par[name][k]
    double qw = b->x[3][k], qx = b->x[4][k], qy = b->x[5][k], qz = b->x[6][k];
    double u = b->x[7][k], v = b->x[8][k], w = b->x[9][k];
    double p = b->x[10][k], q = b->x[11][k], r = b->x[12][k];

    double xx = 1.0 - 2.0 * (qy * qy + qz * qz), xy = 2.0 * (qx * qy - qw * qz);
    double xz = 2.0 * (qx * qz + qw * qy), yx = 2.0 * (qx * qy + qw * qz);
    double yy = 1.0 - 2.0 * (qx * qx + qz * qz), yz = 2.0 * (qy * qz - qw * qx);
    double zx = 2.0 * (qx * qz - qw * qy), zy = 2.0 * (qy * qz + qw * qx);
    double zz = 1.0 - 2.0 * (qx * qx + qy * qy);

    /* tail motion */
    double sine, cosine;
    sincos_of(b->x[13][k], &sine, &cosine);
    double omega_tail = TWO_PI * b->input[2][k], amplitude = b->input[1][k];
    double angle = b->input[0][k] + amplitude * sine;
    double rate = omega_tail * amplitude * cosine;

    /* barycentre */
    double sine_block, cosine_block;
    sincos_of(b->input[4][k], &sine_block, &cosine_block);
    double bx = P(BRACKET_X) + P(D1) - (P(S_W0) + b->input[3][k] - P(D3));
    double by = P(BRACKET_Y) + P(D2) * sine_block;
    double bz = P(BRACKET_Z) + P(D2) * cosine_block;
    double m = P(MASS), im = P(INVERSE_MASS), mb = P(MASS_BLOCK);
    double cx = (P(STATIC_X) + mb * bx) * im;
    double cy = (P(STATIC_Y) + mb * by) * im;
    double cz = (P(STATIC_Z) + mb * bz) * im;
    double jx = P(REST_OB_X) + P(BLOCK_X) + mb * (by * by + bz * bz);
    double jy = P(REST_OB_Y) + P(BLOCK_Y) + mb * (bx * bx + bz * bz);
    double jz = P(REST_OB_Z) + P(BLOCK_Z) + mb * (bx * bx + by * by);

    /* tail force at its centre of pressure */
    double sine_tail, cosine_tail;
    sincos_of(angle, &sine_tail, &cosine_tail);
    double arm_x = -P(TAIL_R_C) * cosine_tail, arm_y = -P(TAIL_R_C) * sine_tail;
    double nx = -sine_tail, ny = cosine_tail;
    double tx = P(ROOT_X) + arm_x, ty = P(ROOT_Y) + arm_y, tz = P(ROOT_Z);
    double vx = u + (q * tz - r * ty) - rate * arm_y;
    double vy = v + (r * tx - p * tz) + rate * arm_x;
    double vz = w + (p * ty - q * tx);
    double speed = sqrt(vx * vx + vy * vy + vz * vz);
    double s = (nx * vx + ny * vy) * inverse_of(speed);
    double scale = 0.5 * P(DENSITY) * P(TAIL_AREA);
    double drag = -scale * (P(TAIL_C0) + P(TAIL_C2) * (s * s)) * speed;
    double lift = -scale * (P(TAIL_C1) * s) * speed;
    double tail_x = drag * vx + lift * (speed * nx - s * vx);
    double tail_y = drag * vy + lift * (speed * ny - s * vy);
    double tail_z = drag * vz - lift * (s * vz);
    double power = -(arm_x * tail_y - arm_y * tail_x) * rate;

    /* body forces in two planes */
    double speed_1 = sqrt(u * u + w * w), inverse_1 = inverse_of(speed_1);
    double e_1 = u * inverse_1, s_1 = w * inverse_1;
    double scale_1 = 0.5 * P(DENSITY) * (P(AREA_X) * (e_1 * e_1) + P(AREA_Z) * (s_1 * s_1));
    double drag_1 = -scale_1 * (P(XZ_C0) + P(XZ_C2) * (s_1 * s_1)) * speed_1;
    double lift_1 = -scale_1 * (P(XZ_C1) * s_1) * speed_1;
    double my_impact = scale_1 * (speed_1 * speed_1) * (P(XZ_K) * (s_1 * fabs(e_1)));
    double speed_2 = sqrt(u * u + v * v), inverse_2 = inverse_of(speed_2);
    double e_2 = u * inverse_2, s_2 = v * inverse_2;
    double scale_2 = 0.5 * P(DENSITY) * (P(AREA_X) * (e_2 * e_2) + P(AREA_Y) * (s_2 * s_2));
    double drag_2 = -scale_2 * (P(XY_C0) + P(XY_C2) * (s_2 * s_2)) * speed_2;
    double lift_2 = -scale_2 * (P(XY_C1) * s_2) * speed_2;
    double mz_impact = scale_2 * (speed_2 * speed_2) * (P(XY_K) * (s_2 * fabs(e_2)));

    /* gravity, buoyancy and the velocity-dependent inertia terms */
    double weight = m * P(GRAVITY), buoyancy = -P(MASS_BUOYANCY) * P(GRAVITY);
    double gx = weight * zx, gy = weight * zy, gz = weight * zz;
    double ax = q * w - r * v, ay = r * u - p * w, az = p * v - q * u;
    double dx = q * cz - r * cy, dy = r * cx - p * cz, dz = p * cy - q * cx;

    double fx = gx + buoyancy * zx + drag_1 * u - lift_1 * (s_1 * u) + drag_2 * u
                - lift_2 * (s_2 * u) + tail_x - m * (ax + (q * dz - r * dy));
    double fy = gy + buoyancy * zy + drag_2 * v + lift_2 * (speed_2 - s_2 * v) + tail_y
                - m * (ay + (r * dx - p * dz));
    double fz = gz + buoyancy * zz + drag_1 * w + lift_1 * (speed_1 - s_1 * w) + tail_z
                - m * (az + (p * dy - q * dx));
    double mx = cy * gz - cz * gy + P(DAMPING_X) * p + (ty * tail_z - tz * tail_y)
                + (jy - jz) * (q * r) - m * (cy * az - cz * ay);
    double my = cz * gx - cx * gz + P(DAMPING_Y) * q + my_impact + (tz * tail_x - tx * tail_z)
                + (jz - jx) * (p * r) - m * (cz * ax - cx * az);
    double mz = cx * gy - cy * gx + P(DAMPING_Z) * r + mz_impact + (tx * tail_y - ty * tail_x)
                + (jx - jy) * (p * q) - m * (cx * ay - cy * ax);

    /* the mass matrix [[m I, -m S(c)], [m S(c), J]] */
    double i0 = 1.0 / m;
    double a31 = -m * cz, a32 = m * cy, a40 = m * cz, a42 = -m * cx, a50 = -m * cy, a51 = m * cx;
    double l31 = a31 * i0, l32 = a32 * i0, l40 = a40 * i0, l42 = a42 * i0, l50 = a50 * i0;
    double l51 = a51 * i0;
    double s33 = jx - l31 * a31 - l32 * a32, s43 = -l42 * a32, s53 = -l51 * a31;
    double s44 = jy - l40 * a40 - l42 * a42, s54 = -l50 * a40, s55 = jz - l50 * a50 - l51 * a51;
    double y3 = mx - l31 * fy - l32 * fz;
    double y4 = my - l40 * fx - l42 * fz;
    double y5 = mz - l50 * fx - l51 * fy;
    double k33 = s44 * s55 - s54 * s54, k43 = s53 * s54 - s43 * s55, k53 = s43 * s54 - s53 * s44;
    double k44 = s33 * s55 - s53 * s53, k54 = s43 * s53 - s33 * s54, k55 = s33 * s44 - s43 * s43;
    double per = 1.0 / (s33 * k33 + s43 * k43 + s53 * k53);
    double r3 = per * (k33 * y3 + k43 * y4 + k53 * y5);
    double r4 = per * (k43 * y3 + k44 * y4 + k54 * y5);
    double r5 = per * (k53 * y3 + k54 * y4 + k55 * y5);
    double level = inverse_of(sqrt(xx * xx + yx * yx));
    b->slope[0][k] = xx * u + xy * v + xz * w;
    b->slope[1][k] = yx * u + yy * v + yz * w;
    b->slope[2][k] = zx * u + zy * v + zz * w;
    b->slope[3][k] = -0.5 * (qx * p + qy * q + qz * r);
    b->slope[4][k] = 0.5 * (qw * p + qy * r - qz * q);
    b->slope[5][k] = 0.5 * (qw * q + qz * p - qx * r);
    b->slope[6][k] = 0.5 * (qw * r + qx * q - qy * p);
    b->slope[7][k] = fx * i0 - l40 * r4 - l50 * r5;
    b->slope[8][k] = fy * i0 - l31 * r3 - l51 * r5;
    b->slope[9][k] = fz * i0 - l32 * r3 - l42 * r4;
    b->slope[10][k] = r3;
    b->slope[11][k] = r4;
    b->slope[12][k] = r5;
    b->slope[13][k] = omega_tail;
    b->slope[14][k] = xx * level;
    b->slope[15][k] = yx * level;
    b->slope[16][k] = u;
    b->slope[17][k] = power > 0.0 ? power : 0.0;
#undef P
}

static void step(Block *restrict b, double h)
{
    static const double weight[4] = {1.0, 2.0, 2.0, 1.0}, ahead[4] = {0.5, 0.5, 1.0, 0.0};
    double start[STATES][LANES], sum[STATES][LANES];
    for (int j = 0; j < STATES; j++)
        for (int k = 0; k < LANES; k++) {
            start[j][k] = b->x[j][k];
            sum[j][k] = 0.0;
        }
    for (int stage = 0; stage < 4; stage++) {
        double to = stage < 3 ? ahead[stage] * h : 0.0;
        for (int k = 0; k < LANES; k++)
            derivative(b, k);
        for (int j = 0; j < STATES; j++)
            for (int k = 0; k < LANES; k++) {
                sum[j][k] += weight[stage] * b->slope[j][k];
                b->x[j][k] = start[j][k] + to * b->slope[j][k];
            }
    }
    for (int j = 0; j < STATES; j++)
        for (int k = 0; k < LANES; k++)
            b->x[j][k] = start[j][k] + (h / 6.0) * sum[j][k];
    for (int k = 0; k < LANES; k++) {
        double norm = 0.0;
        for (int j = 3; j < 7; j++)
            norm += b->x[j][k] * b->x[j][k];
        double shrink = 1.0 / sqrt(norm);
        for (int j = 3; j < 7; j++)
            b->x[j][k] *= shrink;
    }
}

/* Copy fish first..first+count into a block; spare lanes repeat the last fish. */
static void load(double (*rows)[LANES], const double *source, int count_rows, long n, long first,
                 int count)
{
    for (int j = 0; j < count_rows; j++)
        for (int k = 0; k < LANES; k++)
            rows[j][k] = source[j * n + first + (k < count ? k : count - 1)];
}

/* Advance n fish by steps of h seconds, in place. state (18, n), input (5, n), par (49, n). */
void advance(double *restrict state, const double *restrict input, const double *restrict par,
             long n, long steps, double h)
{
    Block b;
    for (long first = 0; first < n; first += LANES) {
        int count = n - first < LANES ? (int)(n - first) : LANES;
        load(b.x, state, STATES, n, first, count);
        load(b.input, input, INPUTS, n, first, count);
        load(b.par, par, PARAMETERS, n, first, count);
        for (long i = 0; i < steps; i++)
            step(&b, h);
        for (int j = 0; j < STATES; j++)
            for (int k = 0; k < count; k++)
                state[j * n + first + k] = b.x[j][k];
    }
}
