// The paper's own solver, for comparison: dlib's BOBYQA on dE00^2 + dE00^2, a pixel at a time (sections V-A2, V-B2).
//
// Built and run by inversion_benchmark.py:  dlib_bobyqa problem.bin answer.bin rho_end
//
// problem.bin: int64 n, surfaces, pixels; then float64 A (surfaces, 3, n), black (surfaces, 3), white point (3),
// wanted Lab (pixels, surfaces, 3), starts (pixels, n). answer.bin: float64 x (pixels, n), then the CPU seconds.
#include <dlib/optimization.h>

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <ctime>
#include <thread>
#include <vector>

using Column = dlib::matrix<double, 0, 1>;

static const double kPi = 3.14159265358979323846;

static double f_of(double t) { return t > 216.0 / 24389.0 ? std::cbrt(t) : t * 841.0 / 108.0 + 16.0 / 116.0; }

static void XYZ_to_Lab(const double* XYZ, const double* white, double* Lab) {
    const double fx = f_of(XYZ[0] / white[0]), fy = f_of(XYZ[1] / white[1]), fz = f_of(XYZ[2] / white[2]);
    Lab[0] = 116.0 * fy - 16.0;
    Lab[1] = 500.0 * (fx - fy);
    Lab[2] = 200.0 * (fy - fz);
}

// CIEDE2000 squared, step by step as Sharma, Wu and Dalal number it.
static double squared_dE00(const double* p, const double* q) {
    const double mean_C = 0.5 * (std::hypot(p[1], p[2]) + std::hypot(q[1], q[2]));
    const double c7 = std::pow(mean_C, 7), G = 0.5 * (1.0 - std::sqrt(c7 / (c7 + 6103515625.0)));
    const double a1 = (1.0 + G) * p[1], a2 = (1.0 + G) * q[1];
    const double C1 = std::hypot(a1, p[2]), C2 = std::hypot(a2, q[2]);
    double h1 = C1 > 0 ? std::atan2(p[2], a1) : 0.0, h2 = C2 > 0 ? std::atan2(q[2], a2) : 0.0;
    if (h1 < 0) h1 += 2 * kPi;
    if (h2 < 0) h2 += 2 * kPi;
    double dh = h2 - h1;
    if (dh > kPi) dh -= 2 * kPi;
    if (dh < -kPi) dh += 2 * kPi;
    if (C1 * C2 == 0) dh = 0;
    const double dL = q[0] - p[0], dC = C2 - C1, dH = 2.0 * std::sqrt(C1 * C2) * std::sin(0.5 * dh);
    double mean_h = h1 + h2;
    if (C1 * C2 > 0) {
        if (std::fabs(h1 - h2) <= kPi) mean_h *= 0.5;
        else mean_h = mean_h < 2 * kPi ? 0.5 * (mean_h + 2 * kPi) : 0.5 * (mean_h - 2 * kPi);
    }
    const double deg = kPi / 180.0, C = 0.5 * (C1 + C2), L = 0.5 * (p[0] + q[0]) - 50.0;
    const double T = 1.0 - 0.17 * std::cos(mean_h - 30 * deg) + 0.24 * std::cos(2 * mean_h) +
                     0.32 * std::cos(3 * mean_h + 6 * deg) - 0.20 * std::cos(4 * mean_h - 63 * deg);
    const double turn = (mean_h / deg - 275.0) / 25.0, theta = 30.0 * deg * std::exp(-turn * turn);
    const double C7 = std::pow(C, 7), R = -std::sin(2 * theta) * 2.0 * std::sqrt(C7 / (C7 + 6103515625.0));
    const double l = dL / (1.0 + 0.015 * L * L / std::sqrt(20.0 + L * L));
    const double c = dC / (1.0 + 0.045 * C), h = dH / (1.0 + 0.015 * C * T);
    return l * l + c * c + h * h + R * c * h;
}

struct Problem {
    int64_t n, surfaces, pixels;
    std::vector<double> A, black, white, Lab, start;

    double objective(const Column& x, int64_t pixel) const {
        double sum = 0.0;
        for (int64_t s = 0; s < surfaces; ++s) {
            double XYZ[3], seen[3];
            for (int64_t i = 0; i < 3; ++i) {
                XYZ[i] = black[3 * s + i];
                for (int64_t j = 0; j < n; ++j) XYZ[i] += A[(3 * s + i) * n + j] * x(j);
            }
            XYZ_to_Lab(XYZ, white.data(), seen);
            sum += squared_dE00(&Lab[3 * (pixel * surfaces + s)], seen);
        }
        return sum;
    }
};

static bool read_doubles(std::FILE* file, std::vector<double>& values, int64_t count) {
    values.resize(count);
    return std::fread(values.data(), sizeof(double), count, file) == static_cast<size_t>(count);
}

int main(int argc, char** argv) {
    if (argc != 4) return std::fprintf(stderr, "usage: dlib_bobyqa problem.bin answer.bin rho_end\n"), 2;
    Problem p;
    std::FILE* in = std::fopen(argv[1], "rb");
    int64_t sizes[3];
    if (!in || std::fread(sizes, sizeof(int64_t), 3, in) != 3) return std::fprintf(stderr, "cannot read %s\n", argv[1]), 1;
    p.n = sizes[0], p.surfaces = sizes[1], p.pixels = sizes[2];
    if (!read_doubles(in, p.A, p.surfaces * 3 * p.n) || !read_doubles(in, p.black, p.surfaces * 3) ||
        !read_doubles(in, p.white, 3) || !read_doubles(in, p.Lab, p.pixels * p.surfaces * 3) ||
        !read_doubles(in, p.start, p.pixels * p.n))
        return std::fprintf(stderr, "%s is too short\n", argv[1]), 1;
    std::fclose(in);
    const double rho_end = std::atof(argv[3]);
    std::vector<double> answer(p.pixels * p.n);
    auto work = [&](int64_t first, int64_t last) {
        for (int64_t pixel = first; pixel < last; ++pixel) {
            Column x(p.n);
            for (int64_t j = 0; j < p.n; ++j) x(j) = p.start[pixel * p.n + j];
            try {
                dlib::find_min_bobyqa([&](const Column& at) { return p.objective(at, pixel); }, x, 2 * p.n + 1,
                                      dlib::uniform_matrix<double>(p.n, 1, 0.0), dlib::uniform_matrix<double>(p.n, 1, 1.0),
                                      0.2, rho_end, 20000);
            } catch (const dlib::bobyqa_failure&) {
            }  // x is the best so far
            for (int64_t j = 0; j < p.n; ++j) answer[pixel * p.n + j] = x(j);
        }
    };
    const std::clock_t begin = std::clock();
    std::thread other(work, 0, p.pixels / 2);
    work(p.pixels / 2, p.pixels);
    other.join();
    const double seconds = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
    std::FILE* out = std::fopen(argv[2], "wb");
    std::fwrite(answer.data(), sizeof(double), answer.size(), out);
    std::fwrite(&seconds, sizeof(double), 1, out);
    return std::fclose(out);
}
