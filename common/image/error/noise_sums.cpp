// Sums over the pixels of a tile. They are accumulated per column, row by row, so that the compiler
// vectorises the loops; at the end the columns are added up.
#include <algorithm>
#include <cstddef>
#include <numeric>

#include "common/image/error/relative_weights.h"

namespace ls {
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

  // Adds the products of each pixel and the previous one in the row, from which r^2 is computed
  // (error_estimate.h).
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

  // Adds, for each pixel p, the mean of (D(p) . D(q))^2 over its neighbours q, times 1 - g^2. `beside` has
  // these squares for neighbours in the row (beside[x]: with the previous pixel, beside[x + 1]: with the
  // next), `above` and `below` for the rows above and below. They are 0 where there is no neighbour.
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

NoiseSums noise_sums(const std::vector<double>& values, const std::vector<double>& edges, int width,
                     int height) {
  const auto w = static_cast<std::size_t>(width), h = static_cast<std::size_t>(height), n = w * h;
  const auto row = [&](std::size_t y) {
    const double* at = &values[y * w];
    return Values{at, at + n, at + 2 * n, &edges[y * w]};
  };
  Columns columns(w);
  Scanline beside(w + 1), above(w), below(w);  // beside[x] is the pair of the pixels x - 1 and x
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
