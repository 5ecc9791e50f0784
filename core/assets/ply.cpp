#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <optional>
#include <string>
#include <type_traits>
#include <unordered_map>
#include <utility>

#include "core/assets/mesh.h"
#include "core/assets/mesh_parts.h"
#include "core/base/bytes.h"
#include "core/base/file_form.h"

namespace ls {

namespace {

constexpr std::size_t kMaxPlyLines = 1000;

enum class Coding { ascii, little_endian, big_endian };

struct Type {
  std::string_view name;
  std::size_t bytes;
  double largest;  // largest value of an integer type; 0 for a floating-point type
  std::optional<double> (*take)(ByteReader&, bool big_endian);
};
template <class T>
constexpr Type type_of(std::string_view name) {
  return {name, sizeof(T), std::is_integral_v<T> ? static_cast<double>(std::numeric_limits<T>::max()) : 0,
          [](ByteReader& r, bool big_endian) {
            const auto v = r.take<T>(big_endian);
            return v ? std::optional(static_cast<double>(*v)) : std::nullopt;
          }};
}
constexpr Type kTypes[] = {
    type_of<std::int8_t>("char"),     type_of<std::int8_t>("int8"),     type_of<std::uint8_t>("uchar"),
    type_of<std::uint8_t>("uint8"),   type_of<std::int16_t>("short"),   type_of<std::int16_t>("int16"),
    type_of<std::uint16_t>("ushort"), type_of<std::uint16_t>("uint16"), type_of<std::int32_t>("int"),
    type_of<std::int32_t>("int32"),   type_of<std::uint32_t>("uint"),   type_of<std::uint32_t>("uint32"),
    type_of<float>("float"),          type_of<float>("float32"),        type_of<double>("double"),
    type_of<double>("float64")};

const Type* type_named(std::string_view name) {
  const auto it = std::ranges::find(kTypes, name, &Type::name);
  return it == std::end(kTypes) ? nullptr : &*it;
}
bool is_byte(const Type& t) { return t.largest == 255; }

struct Property {
  std::string_view name;
  const Type* type = nullptr;
  const Type* count = nullptr;  // type of a list's length; null if the property is not a list
};
struct Element {
  std::string_view name;
  std::uint64_t count = 0;
  std::vector<Property> properties;

  // Returns the smallest possible number of bytes of one element.
  std::uint64_t least_bytes(Coding c) const {
    if (c == Coding::ascii) return properties.size();
    std::uint64_t n = 0;
    for (const Property& p : properties) n += p.count ? p.count->bytes : p.type->bytes;
    return n;
  }
};

// Returns the slot of a vertex property: 0-2 for the position, 3-5 for the normal, 6-7 for uv; -1 for other
// properties.
int vertex_slot(std::string_view name) {
  constexpr std::pair<std::string_view, int> kSlots[] = {
      {"x", 0}, {"y", 1}, {"z", 2}, {"nx", 3},        {"ny", 4},        {"nz", 5},        {"u", 6},
      {"v", 7}, {"s", 6}, {"t", 7}, {"texture_u", 6}, {"texture_v", 7}, {"texture_s", 6}, {"texture_t", 7}};
  const auto it = std::ranges::find(kSlots, name, &std::pair<std::string_view, int>::first);
  return it == std::end(kSlots) ? -1 : it->second;
}

class PlyReader {
 public:
  // Without `corner_uvs` the texture coordinates of faces are passed over.
  PlyReader(std::string_view name, std::span<const std::byte> file, std::span<const std::string> wanted,
            bool corner_uvs)
      : name_(name), file_(file), wanted_(wanted), corner_uvs_(corner_uvs), body_({}) {
    file_ = file_.subspan(as_text(file_).size() - without_mark(as_text(file_)).size());
    body_ = ByteReader(file_);
  }

  Result<MeshData> read() {
    if (!header() || !elements()) return bad_argument(fmt::format("'{}': {}", name_, problem_));
    return std::move(mesh_);
  }

 private:
  bool complain(std::string text) {
    problem_ = std::move(text);
    return false;
  }
  bool complain_line(std::size_t line, std::string_view text) {
    return complain(fmt::format("line {}: {}", line, text));
  }

  bool header() {
    std::string_view text = as_text(file_);
    const char end = line_end_of(text);
    bool has_format = false;
    for (std::size_t line = 1; line <= kMaxPlyLines; ++line) {
      if (text.empty()) return complain("ends within the header (no end_header)");
      std::string_view rest = next_line(text, end);
      const std::string_view key = next_word(rest);
      if (line == 1) {
        if (key != "ply") return complain("does not begin with \"ply\"");
      } else if (key == "format") {
        has_format = true;
        const std::string_view f = next_word(rest);
        coding_ = f == "ascii"               ? Coding::ascii
                  : f == "binary_big_endian" ? Coding::big_endian
                                             : Coding::little_endian;
        if (coding_ == Coding::little_endian && f != "binary_little_endian")
          return complain_line(line, fmt::format("unknown format '{}'", f.substr(0, 40)));
      } else if (key == "element") {
        if (!element(rest, line)) return false;
      } else if (key == "property") {
        if (!property(rest, line)) return false;
      } else if (key == "end_header") {
        if (!has_format) return complain("the header has no format line");
        body_.skip(file_.size() - text.size());
        // Where files of a header and of numbers were joined, a mark may stand between them.
        rest_ = without_mark(text);
        return true;
      } else if (!key.empty() && key != "comment" && key != "obj_info") {
        return complain_line(line, fmt::format("unknown header line '{}'", key.substr(0, 40)));
      }
    }
    return complain(fmt::format("the header has more than {} lines", kMaxPlyLines));
  }

  bool element(std::string_view rest, std::size_t line) {
    Element e;
    e.name = next_word(rest);
    const std::string_view n = next_word(rest);
    const auto [end, ec] = std::from_chars(n.data(), n.data() + n.size(), e.count);
    if (e.name.empty() || ec != std::errc{} || end != n.data() + n.size())
      return complain_line(line, "an element needs a name and a count");
    elements_.push_back(std::move(e));
    return true;
  }

  bool property(std::string_view rest, std::size_t line) {
    if (elements_.empty()) return complain_line(line, "a property before any element");
    Property p;
    std::string_view word = next_word(rest);
    if (word == "list") {
      p.count = type_named(next_word(rest));
      word = next_word(rest);
      if (!p.count || p.count->largest == 0)
        return complain_line(line, "a list's length needs a whole-number type");
    }
    p.type = type_named(word);
    p.name = next_word(rest);
    if (!p.type || p.name.empty())
      return complain_line(
          line, fmt::format("a property of unknown type '{}' or without a name", word.substr(0, 40)));
    elements_.back().properties.push_back(p);
    return true;
  }

  // A place in the file's body.
  struct Cursor {
    ByteReader body;
    std::string_view rest;
  };

  bool elements() {
    // Faces may stand before the vertices that they name: they are read after them.
    std::vector<std::pair<const Element*, Cursor>> early;
    for (const Element& e : elements_) {
      if (e.properties.empty()) continue;
      const std::uint64_t left = coding_ == Coding::ascii ? rest_.size() : body_.left();
      if (e.count > left / e.least_bytes(coding_))
        return complain(
            fmt::format("{} elements '{}' are announced, but only {} bytes follow", e.count, e.name, left));
      const bool has_vertices = vertex_count_ > 0 || e.name == "vertex";
      if (!has_vertices) early.emplace_back(&e, Cursor{body_, rest_});
      if (!(has_vertices ? read_element(e) : skip(e))) return false;
    }
    for (const auto& [e, cursor] : early) {
      body_ = cursor.body, rest_ = cursor.rest;
      if (!read_element(*e)) return false;
    }
    if (mesh_.indices.empty() && mesh_.dropped_triangles == 0) return complain("has no faces");
    // A file may have several elements of the same name. If an attribute does not have a value for every
    // vertex or triangle, for example because only one of two elements 'face' has it, the file is rejected.
    for (const MeshAttribute& a : mesh_.attributes)
      if (a.values.size() !=
          a.components * (a.name.starts_with("face_") ? mesh_.triangle_count() : mesh_.vertex_count()))
        return complain(fmt::format("not all of it has the attribute '{}'", a.name));
    return true;
  }

  bool read_element(const Element& e) {
    if (e.name == "vertex") return vertices(e);
    if (e.name == "face") return faces(e);
    return e.name == "tristrips" ? strips(e) : skip(e);
  }

  // Returns the next number of the file's body; nullopt at the end of the body, or if the text is not a
  // number.
  std::optional<double> number(const Type& t) {
    if (coding_ != Coding::ascii) return t.take(body_, coding_ == Coding::big_endian);
    constexpr std::string_view kBlanks = " \t\r\n\v\f";
    std::size_t a = rest_.find_first_not_of(kBlanks);
    if (a == rest_.npos) return std::nullopt;
    if (rest_[a] == '+') ++a;
    double v = 0;
    const char* const last = rest_.data() + rest_.size();
    const auto [end, ec] = std::from_chars(rest_.data() + a, last, v);
    if (ec == std::errc::invalid_argument) return std::nullopt;
    // A number too small for double becomes 0 or denormal, one too large infinite. Triangles with an infinite
    // vertex position are left out.
    if (ec == std::errc::result_out_of_range)
      v = std::strtod(std::string(rest_.data() + a, end).c_str(), nullptr);
    if (end != last && kBlanks.find(*end) == kBlanks.npos) return std::nullopt;
    rest_.remove_prefix(static_cast<std::size_t>(end - rest_.data()));
    return v;
  }
  bool broken(const Element& e, std::uint64_t i) {
    const std::size_t at = file_.size() - (coding_ == Coding::ascii ? rest_.size() : body_.left());
    return complain(fmt::format("{} {} of {} cannot be read: the file ends or holds no number at byte {}",
                                e.name, i, e.count, at));
  }
  std::optional<std::uint32_t> list_length(const Property& p) {
    const auto n = number(*p.count);
    if (!n || !(*n >= 0) || *n > kMaxPolygonCorners || *n != std::floor(*n)) return std::nullopt;
    return static_cast<std::uint32_t>(*n);
  }
  bool skip_property(const Property& p) {
    std::uint32_t n = 1;
    if (p.count) {
      const auto length = list_length(p);
      if (!length) return false;
      n = *length;
    }
    for (std::uint32_t i = 0; i < n; ++i)
      if (!number(*p.type)) return false;
    return true;
  }
  bool skip(const Element& e) {
    for (std::uint64_t i = 0; i < e.count; ++i)
      for (const Property& p : e.properties)
        if (!skip_property(p)) return broken(e, i);
    return true;
  }

  bool vertices(const Element& e) {
    if (vertex_count_ > 0) return complain("has two elements 'vertex'");
    if (e.count > kMaxMeshVertices)
      return complain(fmt::format("has {} vertices; the limit is {}", e.count, kMaxMeshVertices));
    std::vector<int> slots;
    std::array<bool, 8> has{};
    for (const Property& p : e.properties) {
      slots.push_back(p.count ? -1 : vertex_slot(p.name));
      if (slots.back() >= 0) has[static_cast<std::size_t>(slots.back())] = true;
    }
    if (!has[0] || !has[1] || !has[2]) return complain("its vertices lack x, y or z");
    const bool normals = has[3] && has[4] && has[5], uvs = has[6] && has[7];
    mesh_.positions.reserve(e.count * 3);
    const auto places = attribute_places(e, "vertex_");
    for (std::uint64_t i = 0; i < e.count; ++i) {
      std::array<float, 8> values{};
      make_room(places);
      for (std::size_t k = 0; k < slots.size(); ++k) {
        if (slots[k] < 0) {
          if (!attribute_property(e.properties[k], places[k])) return broken(e, i);
          continue;
        }
        const auto v = number(*e.properties[k].type);
        if (!v) return broken(e, i);
        values[static_cast<std::size_t>(slots[k])] = static_cast<float>(*v);
      }
      mesh_.positions.insert(mesh_.positions.end(), values.begin(), values.begin() + 3);
      if (normals) mesh_.normals.insert(mesh_.normals.end(), values.begin() + 3, values.begin() + 6);
      if (uvs) mesh_.uvs.insert(mesh_.uvs.end(), values.begin() + 6, values.end());
    }
    vertex_count_ = e.count;
    return true;
  }

  static bool is_corner_list(const Property& p) {
    return p.count && (p.name == "vertex_indices" || p.name == "vertex_index");
  }
  bool wants_corner_list(const Element& e) {
    if (std::ranges::count_if(e.properties, is_corner_list) == 1) return true;
    return complain("its faces need one list 'vertex_indices' or 'vertex_index'");
  }
  bool adds_too_many(std::size_t triangles) {
    if (mesh_.triangle_count() + triangles <= kMaxMeshTriangles) return false;
    complain("has too many triangles");
    return true;
  }
  std::optional<std::uint32_t> vertex_named(const Element& e, std::uint64_t i, double v) {
    if (v >= 0 && v < static_cast<double>(vertex_count_)) return static_cast<std::uint32_t>(v);
    complain(fmt::format("{} {} names vertex {} of {}", e.name, i, v, vertex_count_));
    return std::nullopt;
  }

  bool faces(const Element& e) {
    if (!wants_corner_list(e)) return false;
    const auto is_uv_list = [](const Property& p) { return p.count && p.name == "texcoord"; };
    const bool has_uvs = corner_uvs_ && std::ranges::any_of(e.properties, is_uv_list);
    std::vector<std::uint32_t> corners;
    std::vector<float> uvs;
    const auto places = attribute_places(e, "face_");
    for (std::uint64_t i = 0; i < e.count; ++i) {
      const std::size_t before = mesh_.triangle_count();
      make_room(places);
      for (std::size_t k = 0; k < e.properties.size(); ++k) {
        const Property& p = e.properties[k];
        if (is_corner_list(p)) {
          if (!corner_list(e, i, p, corners)) return false;
        } else if (is_uv_list(p)) {
          if (!uv_list(p, uvs)) return broken(e, i);
        } else if (!attribute_property(p, places[k])) {
          return broken(e, i);
        }
      }
      if (adds_too_many(corners.size())) return false;
      if (has_uvs && !split_by_uv(corners, uvs)) return false;
      add_polygon(mesh_, corners);
      share_among_triangles(places, mesh_.triangle_count() - before);
    }
    return true;
  }

  bool corner_list(const Element& e, std::uint64_t i, const Property& p,
                   std::vector<std::uint32_t>& corners) {
    const auto n = list_length(p);
    if (!n) return broken(e, i);
    corners.clear();
    for (std::uint32_t k = 0; k < *n; ++k) {
      const auto v = number(*p.type);
      if (!v) return broken(e, i);
      const auto vertex = vertex_named(e, i, *v);
      if (!vertex) return false;
      corners.push_back(*vertex);
    }
    return true;
  }

  bool uv_list(const Property& p, std::vector<float>& uvs) {
    const auto n = list_length(p);
    if (!n) return false;
    uvs.clear();
    for (std::uint32_t k = 0; k < *n; ++k) {
      const auto v = number(*p.type);
      if (!v) return false;
      uvs.push_back(static_cast<float>(*v));
    }
    return true;
  }

  // Gives the corners of face i their texture coordinates; no uvs mean those of the vertices, or (0, 0) if
  // these have none. Replaces each corner by the
  // vertex that has its position and its coordinates: the vertex of the file where it comes up first, a copy
  // of it for each further pair of coordinates.
  bool split_by_uv(std::span<std::uint32_t> corners, std::vector<float>& uvs) {
    if (split_.empty()) {
      vertex_uvs_ = std::move(mesh_.uvs);
      mesh_.uvs.assign(2 * mesh_.vertex_count(), 0);
    }
    if (uvs.empty())
      for (const std::uint32_t corner : corners)
        for (const std::size_t k : {0, 1})
          uvs.push_back(vertex_uvs_.empty() ? 0 : vertex_uvs_[2 * corner + k]);
    if (uvs.size() != 2 * corners.size()) return ++mesh_.wrong_uv_faces, true;
    for (std::size_t k = 0; k < corners.size(); ++k) {
      const std::array<float, 2> uv{uvs[2 * k], uvs[2 * k + 1]};
      const auto bits = [](float x) { return static_cast<std::int64_t>(std::bit_cast<std::uint32_t>(x)); };
      const std::uint32_t original = corners[k];
      const auto [it, is_new] = split_.try_emplace(Corner{original, bits(uv[0]), bits(uv[1])}, original);
      if (is_new) {
        // The key (v, -1, -1) says that vertex v of the file has coordinates.
        if (!split_.try_emplace(Corner{original, -1, -1}, original).second) {
          if (mesh_.vertex_count() >= kMaxMeshVertices) return complain("has too many vertices");
          it->second = copy_of(original);
        }
        std::ranges::copy(uv, mesh_.uvs.begin() + std::ptrdiff_t{2} * it->second);
      }
      corners[k] = it->second;
    }
    return true;
  }

  std::uint32_t copy_of(std::uint32_t vertex) {
    const auto copy = static_cast<std::uint32_t>(mesh_.vertex_count());
    const auto repeat = [&](std::vector<float>& values, std::size_t components) {
      if (values.empty()) return;
      for (std::size_t c = 0; c < components; ++c) values.push_back(values[vertex * components + c]);
    };
    repeat(mesh_.positions, 3);
    repeat(mesh_.normals, 3);
    repeat(mesh_.uvs, 2);
    for (MeshAttribute& a : mesh_.attributes)
      if (a.name.starts_with("vertex_")) repeat(a.values, a.components);
    return copy;
  }

  // Reads lists of vertices of which each triple of neighbours is a triangle, every other one turned round.
  // -1 ends a strip within a list.
  bool strips(const Element& e) {
    if (!wants_corner_list(e)) return false;
    for (std::uint64_t i = 0; i < e.count; ++i)
      for (const Property& p : e.properties)
        if (!(is_corner_list(p) ? strip(e, i, p) : skip_property(p))) return problem_.empty() && broken(e, i);
    return true;
  }
  bool strip(const Element& e, std::uint64_t i, const Property& p) {
    const auto n = number(*p.count);
    if (!n || !(*n >= 0)) return false;
    std::vector<std::uint32_t> last;  // up to two vertices before the next one
    bool is_odd = false;
    for (double k = 0; k < *n; ++k) {
      const auto v = number(*p.type);
      if (!v) return false;
      if (*v == -1) {
        last.clear(), is_odd = false;
        continue;
      }
      const auto vertex = vertex_named(e, i, *v);
      if (!vertex || adds_too_many(1)) return false;
      if (last.size() == 2) {
        const std::array<std::uint32_t, 3> corners{last[is_odd ? 1 : 0], last[is_odd ? 0 : 1], *vertex};
        add_polygon(mesh_, corners);
        is_odd = !is_odd;
        last.erase(last.begin());
      }
      last.push_back(*vertex);
    }
    return true;
  }

  // Where the values of a PLY property are stored: one component of a requested attribute.
  struct Place {
    int attribute = -1;  // index in mesh_.attributes; -1: the property belongs to no requested attribute
    std::size_t component = 0;
  };
  std::vector<Place> attribute_places(const Element& e, std::string_view prefix) {
    std::vector<std::string_view> names;
    for (const Property& p : e.properties) names.push_back(p.count ? std::string_view{} : p.name);
    std::vector<Place> places(names.size());
    for (const PlyAttribute& a : ply_attributes(names)) {
      const std::string name = std::string(prefix) + a.name;
      mesh_.attribute_names.push_back(name);
      if (std::ranges::find(wanted_, name) == wanted_.end()) continue;
      for (std::size_t c = 0; c < a.properties.size(); ++c)
        places[a.properties[c]] = {static_cast<int>(mesh_.attributes.size()), c};
      mesh_.attributes.push_back({name,
                                  static_cast<std::uint32_t>(a.properties.size()),
                                  is_byte(*e.properties[a.properties[0]].type),
                                  {}});
    }
    return places;
  }
  // Makes room for the attributes of one more vertex or face.
  void make_room(const std::vector<Place>& places) {
    for (const Place& p : places)
      if (p.attribute >= 0 && p.component == 0) {
        MeshAttribute& a = mesh_.attributes[static_cast<std::size_t>(p.attribute)];
        a.values.resize(a.values.size() + a.components);
      }
  }
  bool attribute_property(const Property& p, const Place& place) {
    if (place.attribute < 0) return skip_property(p);
    const auto v = number(*p.type);
    if (!v) return false;
    MeshAttribute& a = mesh_.attributes[static_cast<std::size_t>(place.attribute)];
    a.values[a.values.size() - a.components + place.component] = static_cast<float>(decoded(*p.type, *v));
    return true;
  }
  // Decodes a value of an attribute. Unsigned bytes and floating-point numbers are returned as they are. As
  // in Mitsuba 3.9, values of all other integer types are taken as sRGB codes and made linear, whatever the
  // attribute's name.
  static double decoded(const Type& t, double v) {
    if (t.largest == 0 || is_byte(t)) return v;
    const double x = v / t.largest;
    return x <= .04045 ? x / 12.92 : std::pow((x + .055) / 1.055, 2.4);
  }
  // Repeats the attributes of the face that was read last, so that each of its `triangles` triangles has a
  // copy. Removes them if the face has no triangles.
  void share_among_triangles(const std::vector<Place>& places, std::size_t triangles) {
    for (const Place& p : places) {
      if (p.attribute < 0 || p.component > 0) continue;
      MeshAttribute& a = mesh_.attributes[static_cast<std::size_t>(p.attribute)];
      if (triangles == 0) a.values.resize(a.values.size() - a.components);
      for (std::size_t i = 1; i < triangles; ++i)
        for (std::uint32_t c = 0; c < a.components; ++c)
          a.values.push_back(a.values[a.values.size() - a.components]);
    }
  }

  std::string_view name_;
  std::span<const std::byte> file_;
  std::span<const std::string> wanted_;
  bool corner_uvs_;
  ByteReader body_;        // rest of a binary file after the header
  std::string_view rest_;  // rest of an ascii file after the header
  Coding coding_ = Coding::ascii;
  std::vector<Element> elements_;
  std::uint64_t vertex_count_ = 0;  // of the file; split_by_uv() adds copies to the mesh
  std::vector<float> vertex_uvs_;   // texture coordinates of the file's vertices; empty: they have none
  // The vertices of the mesh by vertex of the file and texture coordinates, as numbers of their bits
  std::unordered_map<Corner, std::uint32_t, CornerHash> split_{0, CornerHash{secret_of_this_process()}};
  std::string problem_;
  MeshData mesh_;
};

}  // namespace

Result<MeshData> decode_ply(std::string_view name, std::span<const std::byte> file,
                            std::span<const std::string> attributes) {
  auto mesh = PlyReader(name, file, attributes, true).read();
  if (!mesh || mesh->wrong_uv_faces == 0) return mesh;
  // Vertices may have been split by then, so the file is read once more.
  auto plain = PlyReader(name, file, attributes, false).read();
  if (plain) plain->wrong_uv_faces = mesh->wrong_uv_faces;
  return plain;
}

}  // namespace ls
