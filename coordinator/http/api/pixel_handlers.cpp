// Handlers that return the layers of an image as numbers, for viewers.
#include <array>
#include <charconv>

#include "coordinator/http/api/api.h"
#include "coordinator/http/api/handlers.h"

namespace ls::http {
namespace {

// Parses N non-negative whole numbers, separated by commas; false: the text is anything else.
template <std::size_t N>
bool read_numbers(std::string_view text, std::array<int, N>& out) {
  const char* at = text.data();
  const char* const end = at + text.size();
  for (std::size_t i = 0; i < N; ++i) {
    if (i > 0 && (at == end || *at++ != ',')) return false;
    const auto [next, error] = std::from_chars(at, end, out[i]);
    if (error != std::errc{} || out[i] < 0) return false;
    at = next;
  }
  return at == end;
}

}  // namespace

Response get_layers(Api& api, const Request&, const JobId& id) {
  auto layers = api.coordinator().layers_json(id);
  return layers ? json_response(200, std::move(*layers)) : problem(layers.error());
}

Response get_pixels(Api& api, const Request& request, const JobId& id) {
  if (const auto owner = api.coordinator().owner(id); !owner) return problem(owner.error());
  std::array<int, 1> level{};
  if (const auto text = request.parameter("level"); text && !read_numbers(*text, level))
    return problem(400, "'level' must be a whole number: 0 is the image, each level more has half the side");
  std::array<int, 4> rect{};
  if (!read_numbers(request.parameter("rect").value_or(""), rect))
    return problem(400, "'rect' must be four whole numbers x0,y0,x1,y1, in pixels of the level");
  auto pixels = api.coordinator().pixels(id, {std::string(request.parameter("layer").value_or("rgb")),
                                              level[0],
                                              {rect[0], rect[1], rect[2], rect[3]}});
  if (!pixels) return problem(pixels.error());
  return {.content_type = "application/octet-stream", .body = std::move(*pixels)};
}

}  // namespace ls::http
