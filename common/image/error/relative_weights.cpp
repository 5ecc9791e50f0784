#include "common/image/error/relative_weights.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <memory>

namespace ls {
namespace {

constexpr std::size_t kWindowReach = 2;  // radius of the 5 x 5 window
constexpr double kSignificant = 9;       // square of three standard deviations

// Uninitialised memory. It is written before it is read, and initialising it would take as long as computing
// the sums.
class Room {
 public:
  explicit Room(std::size_t size) : values_(std::make_unique_for_overwrite<double[]>(size)) {}
  double* at(std::size_t i) { return &values_[i]; }
  const double* at(std::size_t i) const { return &values_[i]; }

 private:
  std::unique_ptr<double[]> values_;
};

// The parameters are values, not references, so that the compiler turns the calls into vector instructions.
inline double larger(double a, double b) { return a < b ? b : a; }
inline double smaller(double a, double b) { return b < a ? b : a; }

// Sums over 5 x 5 windows, clipped to the tile, first along rows and then along columns. Both passes access
// memory sequentially.
class Windows {
 public:
  Windows(std::size_t width, std::size_t height)
      : width_(width),
        height_(height),
        padded_(width + 2 * kWindowReach),
        rows_(width * (height + 2 * kWindowReach)) {}

  void sum(const double* values, double* __restrict sums) {
    const std::size_t w = width_;
    for (std::size_t y = 0; y < height_; ++y) {
      std::copy_n(values + y * w, w, &padded_[kWindowReach]);
      const double* __restrict in = padded_.data();
      double* __restrict out = &rows_[(y + kWindowReach) * w];
      for (std::size_t x = 0; x < w; ++x) out[x] = in[x] + in[x + 1] + in[x + 2] + in[x + 3] + in[x + 4];
    }
    const double* __restrict in = rows_.data();
    const std::size_t n = w * height_;
    for (std::size_t i = 0; i < n; ++i)
      sums[i] = in[i] + in[i + w] + in[i + 2 * w] + in[i + 3 * w] + in[i + 4 * w];
  }

 private:
  std::size_t width_, height_;
  std::vector<double> padded_, rows_;
};

double span_of(std::size_t i, std::size_t count) {
  return static_cast<double>(std::min(count - 1, i + kWindowReach) -
                             (i > kWindowReach ? i - kWindowReach : 0) + 1);
}

// Returns f = 1 / (m^2 + c) minus f" s2 / 2, limited to [f/2, 2f], where f" = (6 m^2 - 2 c) / (m^2 + c)^3.
inline double corrected(double m, double f, double s2) {
  return smaller(larger(f - s2 * (3 * m * m - kRelMseDenominator) * f * f * f, f / 2), 2 * f);
}

// One channel of one tile: S, S^2, D^2 of its pixels, and their window sums.
struct Channel {
  std::size_t size;
  Room own, square, noise, own_sum, square_sum, noise_sum;
  explicit Channel(std::size_t n)
      : size(n), own(n), square(n), noise(n), own_sum(n), square_sum(n), noise_sum(n) {}

  void read(const double* a, const double* b, Windows& windows) {
    double* __restrict s = own.at(0), * __restrict s2 = square.at(0), * __restrict d2 = noise.at(0);
    for (std::size_t i = 0; i < size; ++i) {
      const double mean = 0.5 * (a[i] + b[i]), d = a[i] - b[i];
      s[i] = mean;
      s2[i] = mean * mean;
      d2[i] = 0.25 * d * d;
    }
    windows.sum(s, own_sum.at(0));
    windows.sum(s2, square_sum.at(0));
    windows.sum(d2, noise_sum.at(0));
  }
};

// Computes the weights of one row of pixels, which starts at `at`. `spans` are the widths of the windows in
// pixels, `rows` is their height.
void weigh_row(const Channel& c, std::size_t at, const std::vector<double>& spans, double rows,
               double* __restrict roots, double* __restrict leans, double* __restrict edges) {
  const double *__restrict own = c.own.at(at), *__restrict square = c.square.at(at), *__restrict noise = c.noise.at(at);
  const double *__restrict sum = c.own_sum.at(at), *__restrict squares = c.square_sum.at(at),
               *__restrict noises = c.noise_sum.at(at), *__restrict span = spans.data();
  const std::size_t width = spans.size();
  for (std::size_t x = 0; x < width; ++x) {
    const double others = span[x] * rows - 1, s = own[x], d2 = noise[x];
    const double mean = (sum[x] - s) / others, u = larger(0, noises[x] - d2) / others, off = s - mean;
    double structure = larger(0, (squares[x] - square[x]) / others - mean * mean - u * (1 - 1 / others));
    const double bright = off * off > kSignificant * larger(u, d2) ? off * off : 0;
    structure = larger(structure, bright);
    const double v = d2 > structure + u ? d2 : u, all = structure + v;
    const double g = structure > 0 ? structure / all : 0;
    const double m = mean + g * off, f = 1 / (m * m + kRelMseDenominator);
    roots[x] = std::sqrt(corrected(m, f, u * (g * g + (1 - g) * (1 - g) / others)));
    leans[x] = -2 * m * f * f * g;
    edges[x] += g / 3;
  }
}

// A tile of one pixel has no neighbours, so its own value is used.
void weigh_alone(const HalfMeans& h, RelativeWeights& out) {
  for (std::size_t c = 0; c < 3; ++c) {
    const double m = 0.5 * (h.a[c] + h.b[c]), f = 1 / (m * m + kRelMseDenominator);
    out.roots[c] = std::sqrt(f);
    out.leans[c] = -2 * m * f * f;
  }
  out.edges[0] = 1;
}

}  // namespace

double relative_weight(double m, double s2) { return corrected(m, 1 / (m * m + kRelMseDenominator), s2); }

RelativeWeights relative_weights(const HalfMeans& h) {
  const auto width = static_cast<std::size_t>(h.width), height = static_cast<std::size_t>(h.height),
             n = width * height;
  RelativeWeights out{std::vector<double>(3 * n), std::vector<double>(3 * n), std::vector<double>(n)};
  if (n == 1) {
    weigh_alone(h, out);
    return out;
  }
  std::vector<double> spans(width);
  for (std::size_t x = 0; x < width; ++x) spans[x] = span_of(x, width);
  Windows windows(width, height);
  Channel channel(n);
  for (std::size_t plane = 0; plane < 3 * n; plane += n) {
    channel.read(&h.a[plane], &h.b[plane], windows);
    for (std::size_t y = 0; y < height; ++y)
      weigh_row(channel, y * width, spans, span_of(y, height), &out.roots[plane + y * width],
                &out.leans[plane + y * width], &out.edges[y * width]);
  }
  for (double& g : out.edges) g *= g;
  return out;
}

}  // namespace ls
