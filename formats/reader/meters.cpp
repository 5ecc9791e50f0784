// Reads sensors that measure numbers: meters, on shapes and at points.
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>

#include "core/base/file_form.h"
#include "core/base/frame_range.h"
#include "core/scene/schema/validate.h"
#include "formats/reader/mitsuba_plugins.h"
#include "formats/reader/reader.h"
#include "formats/xml/transform_element.h"
#include "formats/xml/values.h"

namespace ls::scene {
namespace {

constexpr std::size_t columns_of(MeterKind kind) { return kind == MeterKind::fluence ? 3 : 6; }
constexpr std::string_view row_of(MeterKind kind) {
  return kind == MeterKind::fluence ? "x y z" : "x y z nx ny nz";
}

// Returns the vector with length 1; nullopt if it has no direction. A vector of length 1, up to rounding, is
// returned as it is, so that a scene that was written is read as the same scene.
std::optional<Vec3> direction_of(const Vec3& v) {
  constexpr double kRounding = 1e-14;  // some ulps of the square of a normalised vector's length
  if (std::abs(dot(v, v) - 1) < kRounding) return v;
  return unit(v);
}

// True if the row has names of columns instead of numbers.
bool is_heading(std::string_view row) {
  bool names = false;
  for (std::size_t i = 0; i < row.size();) {
    const auto begin = row.find_first_not_of(", \t\r", i);
    if (begin == row.npos) break;
    i = std::min(row.find_first_of(", \t\r", begin), row.size());
    const std::string_view word = row.substr(begin, i - begin);
    if (parse_number(word) || word == "nan" || word == "NaN" || word == "inf") return false;
    names = names || std::isalpha(static_cast<unsigned char>(word[0])) || word[0] == '"';
  }
  return names;
}

// Reads one row, `text`, as a point; otherwise returns what is wrong with it.
tl::expected<MeterPoint, std::string> point_of(std::string_view text, MeterKind kind) {
  const std::size_t wanted = columns_of(kind);
  const auto numbers = parse_numbers(text, 64);
  if (!numbers) return tl::unexpected(fmt::format("a row has {} finite numbers: {}", wanted, row_of(kind)));
  if (numbers->size() != wanted)
    return tl::unexpected(
        fmt::format("a row has {} numbers, {}, and this one {}", wanted, row_of(kind), numbers->size()));
  const auto& n = *numbers;
  MeterPoint p{{{n[0], n[1], n[2]}}, {}};
  if (kind == MeterKind::fluence) return p;
  const auto direction = direction_of({{n[3], n[4], n[5]}});
  if (!direction)
    return tl::unexpected(std::string("nx, ny, nz have no direction: their length is 0 or no number"));
  p.direction = *direction;
  return p;
}

}  // namespace

// Reads the sensors of a batch, which must be meters: a job has one image.
void Reader::read_batch(const Element& e) {
  Params p(*this, e);
  const auto sensors = p.take_nested("sensor");
  for (const auto& [object, use] : sensors) {
    if (object->get("type") != "batch" && object->get("type").ends_with("meter"))
      read_sensor(*object);
    else
      report_.error(use->at,
                    fmt::format("a batch can only hold meters, not a \"{}\": a job has one image, so submit "
                                "the scene once for each of its cameras",
                                object->get("type")));
  }
  if (sensors.empty()) report_.error(e.at, "this batch has no sensors");
  // Mitsuba puts the images of a batch side by side in its film.
  read_meter_film(p);
  p.finish();
}

// Reads film and sampler. Of these only the number of samples matters: the largest of all meters.
void Reader::read_meter_film(Params& p) {
  const FilmSettings before = scene_.film;
  const std::uint64_t samples = scene_.sample_count;
  if (const auto film = p.take_only("film", "this sensor", "film")) {
    read_film(*film->object);
    if (scene_.film.size.pixels() > 1)
      report_.warning_once(film->use->at, "the film of a meter has no effect: it makes no image");
    scene_.film = before;
  }
  if (const auto sampler = p.take_only("sampler", "this sensor", "sampler")) {
    read_sampler(*sampler->object);
    if (sampled_) scene_.sample_count = std::max(scene_.sample_count, samples);
    sampled_ = true;
  }
}

std::optional<MeterIndex> Reader::read_meter(const Element& e, const Shape* shape) {
  const std::string_view type = e.get("type");
  Meter meter;
  const auto named = std::ranges::find(NamesOf<MeterKind>::all, type, &Named<MeterKind>::name);
  if (named == NamesOf<MeterKind>::all.end()) {
    if (!is_read_plugin("sensor", type))
      unknown_plugin(e, report_);
    else
      report_.error(e.at, fmt::format("a sensor \"{}\" stands in no shape: only an irradiancemeter or a "
                                      "fluxmeter does",
                                      type));
    return std::nullopt;
  }
  meter.kind = named->value;
  Params p(*this, e);
  if (meters_.size() == kMaxMeterSensors)
    return report_.refuse(
        e.at, fmt::format("more than {} meters: give the points of several as one list", kMaxMeterSensors));
  meters_.push_back(&e);
  meter.name = e.find("id") ? std::string(e.get("id")) : fmt::format("meter{}", meters_.size());
  if (meter.name.size() > kMaxMeterNameBytes)
    return report_.refuse(e.at, fmt::format("the id of a meter has at most {} bytes", kMaxMeterNameBytes));
  const bool at_points =
      p.has("points") || p.has("filename") || p.has("origin") || p.has("direction") || p.has("to_world");
  const bool may_be_in_shape = meter.kind == MeterKind::irradiance || meter.kind == MeterKind::flux;
  if (shape && (!may_be_in_shape || at_points))
    return report_.refuse(e.at, fmt::format("{} measures {}: place it outside of the shape", p.title(),
                                            may_be_in_shape ? "the shape or points, not both" : "at points"));
  if (!shape && meter.kind == MeterKind::flux)
    return report_.refuse(e.at, "a fluxmeter stands in the shape that it measures");
  if (!shape) {
    auto points = read_meter_points(e, p, meter.kind);
    if (!points) return std::nullopt;
    meter.points = std::move(*points);
  }
  meter_points_ += meter.count();
  if (meter_points_ > static_cast<std::size_t>(kMaxMeters))
    return report_.refuse(e.at, fmt::format("the meters of the scene have more than {} points", kMaxMeters));
  read_sensor_medium(p, meter.medium);
  read_meter_film(p);
  p.finish();
  scene_.meters.push_back(std::move(meter));
  return MeterIndex{static_cast<std::uint32_t>(scene_.meters.size() - 1)};
}

std::optional<std::vector<MeterPoint>> Reader::read_meter_points(const Element& e, Params& p,
                                                                 MeterKind kind) {
  const Element* text = p.take("points");
  const Element* file = p.take("filename");
  if (!text && !file) {
    const auto point = read_meter_point(e, p, kind);
    if (!point) return std::nullopt;
    return std::vector{*point};
  }
  if (text && file)
    return report_.refuse(file->at, fmt::format("{} has both points and filename", p.title()));
  const Element& given = *(text ? text : file);
  for (const std::string_view other : {"origin", "direction", "to_world"})
    if (const Element* further = p.take(other))
      return report_.refuse(further->at,
                            fmt::format("{} has a list of points, so no '{}'", p.title(), other));
  if (given.tag != "string")
    return report_.refuse(given.at, fmt::format("'{}' is a <string>", text ? "points" : "filename"));
  const Span at = value_place(given, "value");
  if (file) return read_meter_file(std::string(file->get("value")), at, kind);
  std::vector<MeterPoint> points;
  const std::string_view rows = text->get("value");
  for (std::size_t begin = 0; begin < rows.size();) {
    const std::size_t end = std::min(rows.find(';', begin), rows.size());
    const std::string_view row = rows.substr(begin, end - begin);
    begin = end + 1;
    if (row.find_first_not_of(" \t\r\n") == row.npos) continue;
    const auto point = point_of(row, kind);
    if (!point) return report_.refuse(at, fmt::format("row {}: {}", points.size() + 1, point.error()));
    points.push_back(*point);
  }
  if (points.empty()) return report_.refuse(at, fmt::format("{} has no points", p.title()));
  return points;
}

// Reads the position and direction of a single point.
std::optional<MeterPoint> Reader::read_meter_point(const Element& e, Params& p, MeterKind kind) {
  MeterPoint point{{}, {{0, 0, 1}}};
  const bool aims = kind != MeterKind::fluence, has_place = p.has("origin"), has_aim = p.has("direction");
  if (p.has("to_world") && (has_place || has_aim))
    return report_.refuse(e.at, fmt::format("{} gives both to_world and origin or direction", p.title()));
  if (!p.has("to_world") && (!has_place || (aims && !has_aim)))
    return report_.refuse(
        e.at, fmt::format("{} needs {}, a to_world, or a list of points in 'points' or a file 'filename'{}",
                          p.title(), aims ? "an origin and a direction" : "an origin",
                          kind == MeterKind::irradiance ? ", or stands in the shape that it measures" : ""));
  if (const auto to_world = p.take_transform("to_world")) {
    point.position = transform_point(*to_world, {{0, 0, 0}});
    point.direction = transform_vector(*to_world, {{0, 0, 1}});
  }
  p.read({.name = "origin", .doc = "", .given_as = "point"}, point.position);
  if (aims) p.read({.name = "direction", .doc = "", .given_as = "vector"}, point.direction);
  if (!std::isfinite(dot(point.position, point.position)))
    return report_.refuse(e.at, fmt::format("{} is at no finite place", p.title()));
  if (!aims) return MeterPoint{point.position, {}};
  const auto direction = direction_of(point.direction);
  if (!direction)
    return report_.refuse(e.at, fmt::format("{} has a direction of length 0, or of no number", p.title()));
  point.direction = *direction;
  return point;
}

// Reads a text file of points: a row per line, numbers separated by blanks or commas, # before comments. The
// first row may name the columns.
std::optional<std::vector<MeterPoint>> Reader::read_meter_file(const std::string& written, const Span& at,
                                                               MeterKind kind) {
  const std::string name = document_.frame ? numbered(written, *document_.frame) : written;
  if (name.empty()) return report_.refuse(at, "the name of a file is wanted here");
  Result<std::string> text;
  std::string found;
  for (const std::string& place : places_of(name)) {
    found = place;
    text = assets_.text(place);
    if (text || text.error().code != Errc::not_found) break;
  }
  if (!text) return report_.refuse(at, text.error().message);
  meter_file_bytes_ += text->size();
  if (meter_file_bytes_ > kMaxTotalTextBytes)
    return report_.refuse(at, fmt::format("files of points have more than {} MiB", kMaxTotalTextBytes >> 20));
  const std::uint32_t file = report_.add_file(SourceText(found, std::string(without_mark(*text))));
  const std::string_view rows = report_.file(file).text();
  std::vector<MeterPoint> points;
  bool may_be_heading = true;
  for (std::size_t begin = 0; begin < rows.size();) {
    const std::size_t start = begin, end = std::min(rows.find('\n', begin), rows.size());
    std::string_view row = rows.substr(begin, end - begin);
    begin = end + 1;
    row = row.substr(0, row.find('#'));
    while (!row.empty() && std::isspace(static_cast<unsigned char>(row.back()))) row.remove_suffix(1);
    if (row.empty()) continue;
    const Span here{file, start, row.size()};
    if (std::exchange(may_be_heading, false) && is_heading(row)) continue;
    if (points.size() == static_cast<std::size_t>(kMaxMeters))
      return report_.refuse(here, fmt::format("more than {} points", kMaxMeters));
    const auto point = point_of(row, kind);
    if (!point) return report_.refuse(here, point.error());
    points.push_back(*point);
  }
  if (points.empty()) return report_.refuse(at, fmt::format("\"{}\" has no rows: nothing to measure", name));
  return points;
}

// Checks that the scene has nothing that belongs to images, and sets its film.
void Reader::finish_meters() {
  if (sensor_)
    return report_.error(sensor_->at,
                         fmt::format("a camera and a meter ({}) in one scene: a job makes an image or "
                                     "measures; put the two into two scenes",
                                     report_.refer_to(meters_[0]->at, sensor_->at)));
  if (!scene_.aovs.empty())
    return report_.error(integrator_->at, "AOVs belong to an image, and this scene has meters");
  if (report_.has_errors()) return;
  scene_.sensor = {};
  scene_.sensor.projection = Projection::meters;
  scene_.film = film_of_meters(meter_count(scene_));
}

}  // namespace ls::scene
