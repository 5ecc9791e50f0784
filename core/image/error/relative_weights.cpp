#include "core/image/error/relative_weights.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <memory>
#include <numeric>

namespace ls {

namespace {

constexpr std::size_t kWindowReach = 2;  // radius of the 5 x 5 window
// A squared deviation counts as significant if it exceeds this many variances (three standard deviations).
constexpr double kSignificant = 9;

// Memory for doubles that is not initialised. Every value is written before it is read, and initialising
// would take as long as computing the sums.
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

// Computes sums over 5 x 5 windows, clipped to the tile: first along rows, then along columns. Both passes
// access memory sequentially.
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

// Returns f = 1 / (m^2 + c) minus f" s2 / 2, limited to [f/2, 2f]. Here c is kRelMseDenominator, and f" is
// the second derivative of f:
//   f" = (6 m^2 - 2 c) / (m^2 + c)^3.
inline double corrected(double m, double f, double s2) {
  return smaller(larger(f - s2 * (3 * m * m - kRelMseDenominator) * f * f * f, f / 2), 2 * f);
}

// One channel of a tile: S, S^2 and D^2 of each pixel (error_estimate.h), and the sums of each over windows.
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

// Computes the weights of one row of pixels, which starts at the index `at` of the channel. spans[x] is the
// width of the window of pixel x, in pixels; `rows` is the height of all these windows.
void weigh_row(const Channel& c, std::size_t at, const std::vector<double>& spans, double rows,
               double* __restrict roots, double* __restrict leans, double* __restrict edges,
               double* __restrict unsure) {
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
    const bool outlier = d2 > structure + u;
    const double v = outlier ? d2 : u, all = structure + v;
    const double g = structure > 0 ? structure / all : 0;
    const double m = mean + g * off, f = 1 / (m * m + kRelMseDenominator);
    const double w = corrected(m, f, u * (g * g + (1 - g) * (1 - g) / others));
    roots[x] = std::sqrt(w);
    unsure[x] += outlier ? d2 * larger(0, w - 1 / (s * s + kRelMseDenominator)) : 0;
    leans[x] = -2 * m * f * f * g;
    edges[x] += g / 3;
  }
}

// Computes the weights of a tile of one pixel: it has no neighbours, so its own value is used.
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
  RelativeWeights out{std::vector<double>(3 * n), std::vector<double>(3 * n), std::vector<double>(n),
                      std::vector<double>(n)};
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
                &out.leans[plane + y * width], &out.edges[y * width], &out.unsure[y * width]);
  }
  for (double& g : out.edges) g *= g;
  return out;
}

namespace {

using Scanline = std::vector<double>;

// A row of three planes of values, and the g^2 of its pixels (`edges`).
struct Values {
  const double *r, *g, *b, *edges;
};

void add_squares(const Values& v, std::size_t width, double* __restrict squares, double* __restrict largest) {
  const double* __restrict r = v.r, * __restrict g = v.g, * __restrict b = v.b;
  for (std::size_t x = 0; x < width; ++x) {
    const double sum = r[x] * r[x] + g[x] * g[x] + b[x] * b[x];
    squares[x] += sum;
    largest[x] = largest[x] < sum ? sum : largest[x];
  }
}

void add_fourths(const Values& v, std::size_t width, double* __restrict channel, double* __restrict pixel,
                 double* __restrict edge_channel, double* __restrict edge_pixel) {
  const double* __restrict r = v.r, * __restrict g = v.g, * __restrict b = v.b, * __restrict edges = v.edges;
  for (std::size_t x = 0; x < width; ++x) {
    const double rr = r[x] * r[x], gg = g[x] * g[x], bb = b[x] * b[x], sum = rr + gg + bb;
    const double fourth = rr * rr + gg * gg + bb * bb, square = sum * sum;
    channel[x] += fourth;
    pixel[x] += square;
    edge_channel[x] += edges[x] * fourth;
    edge_pixel[x] += edges[x] * square;
  }
}

struct Columns {
  Scanline squares, channel_fourth, pixel_fourth, pair_covariance, pair_variance, edge_channel_fourth,
      edge_pixel_fourth, flat_pairs, largest;
  explicit Columns(std::size_t width)
      : squares(width),
        channel_fourth(width),
        pixel_fourth(width),
        pair_covariance(width),
        pair_variance(width),
        edge_channel_fourth(width),
        edge_pixel_fourth(width),
        flat_pairs(width),
        largest(width) {}

  void add_pixels(const Values& v) {
    const std::size_t width = squares.size();
    add_squares(v, width, squares.data(), largest.data());
    add_fourths(v, width, channel_fourth.data(), pixel_fourth.data(), edge_channel_fourth.data(),
                edge_pixel_fourth.data());
  }

  // Adds the products of each pixel and the previous one in the row, from which the squared correlation of
  // two channels (r^2 in error_estimate.h) is computed.
  void add_pairs(const Values& v) {
    double* __restrict covariance = pair_covariance.data(), * __restrict variance = pair_variance.data();
    const std::size_t width = squares.size();
    for (std::size_t x = 1; x < width; ++x) {
      const double r = v.r[x], g = v.g[x], b = v.b[x], r1 = v.r[x - 1], g1 = v.g[x - 1], b1 = v.b[x - 1];
      const double rr = r * r, gg = g * g, bb = b * b, r2 = r1 * r1, g2 = g1 * g1, b2 = b1 * b1;
      covariance[x] += r * g * r1 * g1 + r * b * r1 * b1 + g * b * g1 * b1;
      variance[x] += 0.5 * (rr * g2 + gg * r2 + rr * b2 + bb * r2 + gg * b2 + bb * g2);
    }
  }

  // Adds to flat_pairs, for each pixel p of a row, 1 - g^2 times the mean of (D(p) . D(q))^2 over its
  // neighbours q. These squares are given: beside[x] is for the pixels x - 1 and x of the row, above[x] for
  // pixel x and the one above it, below[x] for pixel x and the one below it. They are 0 where there is no
  // neighbour. `first` and `last` are true in the first and last row of the tile.
  void add_flat(const double* edges, const Scanline& beside, const Scanline& above, const Scanline& below,
                bool first, bool last) {
    const std::size_t width = squares.size();
    const double upright = (first ? 0 : 1) + (last ? 0 : 1);
    const double *before = beside.data(), *up = above.data(), *down = below.data();
    double* __restrict flat = flat_pairs.data();
    const auto add = [&](std::size_t x, double count) {
      const double sum = before[x] + before[x + 1] + up[x] + down[x];
      flat[x] += count > 0 ? (1 - edges[x]) * (sum / count) : 0;
    };
    if (width == 1) return add(0, upright);
    add(0, upright + 1);
    for (std::size_t x = 1; x + 1 < width; ++x) add(x, upright + 2);
    add(width - 1, upright + 1);
  }
};

// Computes (D(p) . D(q))^2 for `count` pairs of neighbours.
void square_dots(const Values& p, const Values& q, std::size_t count, double* out) {
  for (std::size_t x = 0; x < count; ++x) {
    const double dot = p.r[x] * q.r[x] + p.g[x] * q.g[x] + p.b[x] * q.b[x];
    out[x] = dot * dot;
  }
}

double total(const Scanline& row) { return std::accumulate(row.begin(), row.end(), 0.0); }

}  // namespace

// The sums are accumulated per column, row by row, so that the compiler vectorises the loops; at the end the
// columns are added up.
NoiseSums noise_sums(const std::vector<double>& values, const std::vector<double>& edges, int width,
                     int height) {
  const auto w = static_cast<std::size_t>(width), h = static_cast<std::size_t>(height), n = w * h;
  const auto row = [&](std::size_t y) {
    const double* at = &values[y * w];
    return Values{at, at + n, at + 2 * n, &edges[y * w]};
  };
  Columns columns(w);
  Scanline beside(w + 1), above(w), below(w);  // beside[x] is for the pixels x - 1 and x
  for (std::size_t y = 0; y < h; ++y) {
    const Values v = row(y), right{v.r + 1, v.g + 1, v.b + 1, nullptr};
    columns.add_pixels(v);
    columns.add_pairs(v);
    square_dots(v, right, w - 1, beside.data() + 1);
    if (y + 1 < h)
      square_dots(v, row(y + 1), w, below.data());
    else
      std::fill(below.begin(), below.end(), 0);
    columns.add_flat(v.edges, beside, above, below, y == 0, y + 1 == h);
    std::swap(above, below);
  }
  NoiseSums out;
  out.squares = total(columns.squares);
  out.channel_fourth = total(columns.channel_fourth);
  out.pixel_fourth = total(columns.pixel_fourth);
  out.pair_covariance = total(columns.pair_covariance);
  out.pair_variance = total(columns.pair_variance);
  out.edge_channel_fourth = total(columns.edge_channel_fourth);
  out.edge_pixel_fourth = total(columns.edge_pixel_fourth);
  out.flat_pairs = total(columns.flat_pairs);
  out.largest = *std::max_element(columns.largest.begin(), columns.largest.end());
  return out;
}

}  // namespace ls
