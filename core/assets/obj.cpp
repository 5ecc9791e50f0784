#include <fmt/format.h>

#include <array>
#include <charconv>
#include <optional>
#include <random>
#include <unordered_map>

#include "core/assets/mesh.h"
#include "core/assets/mesh_parts.h"
#include "core/base/bytes.h"
#include "core/base/file_form.h"

namespace ls {

namespace {

class ObjReader {
 public:
  explicit ObjReader(std::string_view name) : name_(name) {}

  Result<MeshData> read(std::string_view text) {
    if (const std::string why = why_no_utf8(text); !why.empty())
      return bad_argument(fmt::format("'{}': {}", name_, why));
    text = without_mark(text);
    const char end = line_end_of(text);
    while (!text.empty()) {
      ++line_;
      is_whole_ = text.find(end) != text.npos;
      if (!statement(next_line(text, end), text, end)) return bad();
    }
    if (mesh_.indices.empty() && mesh_.dropped_triangles == 0)
      return bad_argument(fmt::format("'{}': has no faces", name_));
    if (!any_uv_) mesh_.uvs = {};
    if (!any_normal_) mesh_.normals = {};
    return std::move(mesh_);
  }

 private:
  // Reads the statement in `line`. `rest` is the text after it, from which lines that continue the statement
  // are removed.
  bool statement(std::string_view line, std::string_view& rest, char end) {
    const std::string_view key = next_word(line);
    if (key.empty() || key[0] == '#') return true;
    // A statement goes on in the next line if its own ends in a backslash. Names (of materials, of files) may
    // end in one that means nothing.
    if (key == "v" || key == "vt" || key == "vn" || key == "f") line = continued(line, rest, end);
    if (key == "v") return numbers<3>(line, v_, 3);
    if (key == "vt") return numbers<2>(line, vt_, 1);
    if (key == "vn") return numbers<3>(line, vn_, 3);
    if (key == "f") return face(line);
    for (const std::string_view known :
         {"g",      "o",      "s",     "usemtl",     "mtllib",    "p",     "l",        "vp",       "mg",
          "usemap", "maplib", "lod",   "shadow_obj", "trace_obj", "bevel", "c_interp", "d_interp", "cstype",
          "deg",    "curv",   "curv2", "surf",       "parm",      "trim",  "hole",     "scrv",     "sp",
          "end",    "con",    "fo",    "bmat",       "step",      "ctech", "stech"})
      if (key == known) return true;
    return complain(fmt::format("unknown statement '{}'", key.substr(0, 40)));
  }

  std::string_view continued(std::string_view line, std::string_view& rest, char end) {
    const auto goes_on = [](std::string_view l) {
      if (l.ends_with('\r')) l.remove_suffix(1);
      return l.ends_with('\\');
    };
    if (!goes_on(line)) return line;
    joined_.clear();
    for (bool more = true; more;) {
      more = goes_on(line) && !rest.empty();
      joined_ += line.substr(0, goes_on(line) ? line.rfind('\\') : line.size());
      joined_ += ' ';
      if (more) {
        ++line_;
        is_whole_ = rest.find(end) != rest.npos;
        line = next_line(rest, end);
      }
    }
    return joined_;
  }

  // Parses N numbers, of which the first `needed` are required. The rest of the line, such as w or a vertex
  // colour, is ignored.
  template <std::size_t N>
  bool numbers(std::string_view line, std::vector<std::array<float, N>>& into, std::size_t needed) {
    std::array<float, N> a{};
    for (std::size_t i = 0; i < N; ++i) {
      std::string_view w = next_word(line);
      if (w.empty() && i >= needed) break;
      if (!w.empty() && w[0] == '+') w.remove_prefix(1);
      const auto [end, ec] = std::from_chars(w.data(), w.data() + w.size(), a[i]);
      // A number that is too small for float becomes 0 or denormal; one that is too large becomes infinite.
      // add_polygon() leaves out triangles with an infinite vertex position.
      if (ec == std::errc::result_out_of_range)
        a[i] = static_cast<float>(std::strtod(std::string(w.substr(0, 64)).c_str(), nullptr));
      else if (ec != std::errc{} || end != w.data() + w.size())
        return complain(fmt::format("expected {} numbers, found '{}'", needed, w.substr(0, 40)));
    }
    if (into.size() >= kMaxMeshVertices) return complain("too many vertices");
    into.push_back(a);
    return true;
  }

  bool face(std::string_view line) {
    polygon_.clear();
    for (std::string_view w = next_word(line); !w.empty(); w = next_word(line)) {
      if (w[0] == '#') break;
      const auto c = corner(w);
      if (!c) return false;
      if (polygon_.size() >= kMaxPolygonCorners) return complain("a face of too many corners");
      polygon_.push_back(vertex(*c));
    }
    // Some programs write points and edges as faces. These cover nothing, as in PLY files.
    if (polygon_.size() < 3) {
      if (polygon_.empty() || !is_whole_) return complain("a face needs at least three corners");
      return true;
    }
    if (mesh_.triangle_count() + polygon_.size() > kMaxMeshTriangles ||
        mesh_.vertex_count() > kMaxMeshVertices)
      return complain("too many triangles");
    add_polygon(mesh_, polygon_);
    return true;
  }

  std::optional<Corner> corner(std::string_view word) {
    Corner c;
    const std::string_view whole = word;
    std::int64_t* const parts[] = {&c.v, &c.vt, &c.vn};
    const std::size_t counts[] = {v_.size(), vt_.size(), vn_.size()};
    for (int i = 0; i < 3; ++i) {
      const std::size_t slash = std::min(word.find('/'), word.size());
      const std::string_view digits = word.substr(0, slash);
      const bool more = slash < word.size();
      word.remove_prefix(std::min(slash + 1, word.size()));
      if (!digits.empty()) {
        std::int64_t n = 0;
        const auto [end, ec] = std::from_chars(digits.data(), digits.data() + digits.size(), n);
        if (ec != std::errc{} || end != digits.data() + digits.size()) break;
        const auto count = static_cast<std::int64_t>(counts[i]);
        if (n == 0 || n > count || n < -count) {
          complain(fmt::format("index {} in '{}' is out of range: {} so far", n, whole.substr(0, 40), count));
          return std::nullopt;
        }
        *parts[i] = n > 0 ? n - 1 : count + n;
      }
      if (!more) {
        if (c.v < 0) break;
        return c;
      }
    }
    complain(fmt::format("'{}' is no corner of a face (v, v/vt, v//vn or v/vt/vn)", whole.substr(0, 40)));
    return std::nullopt;
  }

  std::uint32_t vertex(const Corner& c) {
    const auto [it, fresh] = known_.try_emplace(c, static_cast<std::uint32_t>(mesh_.vertex_count()));
    if (!fresh) return it->second;
    const auto& p = v_[static_cast<std::size_t>(c.v)];
    mesh_.positions.insert(mesh_.positions.end(), p.begin(), p.end());
    const auto n = c.vn < 0 ? std::array<float, 3>{} : vn_[static_cast<std::size_t>(c.vn)];
    mesh_.normals.insert(mesh_.normals.end(), n.begin(), n.end());
    const auto t = c.vt < 0 ? std::array<float, 2>{} : vt_[static_cast<std::size_t>(c.vt)];
    mesh_.uvs.insert(mesh_.uvs.end(), t.begin(), t.end());
    any_uv_ |= c.vt >= 0;
    any_normal_ |= c.vn >= 0;
    return it->second;
  }

  bool complain(std::string text) {
    problem_ = std::move(text);
    return false;
  }
  tl::unexpected<Error> bad() const {
    return bad_argument(fmt::format("'{}', line {}: {}", name_, line_, problem_));
  }

  std::string_view name_;
  std::uint64_t line_ = 0;
  bool is_whole_ = true;  // true if the current line has a line end
  std::string joined_;    // a statement that goes over several lines
  std::string problem_;
  std::vector<std::array<float, 3>> v_, vn_;
  std::vector<std::array<float, 2>> vt_;
  std::unordered_map<Corner, std::uint32_t, CornerHash> known_{0, CornerHash{secret_of_this_process()}};
  std::vector<std::uint32_t> polygon_;
  MeshData mesh_;
  bool any_uv_ = false, any_normal_ = false;
};

}  // namespace

std::uint64_t secret_of_this_process() {
  static const std::uint64_t secret = [] {
    std::random_device word;
    const std::uint64_t high = word();
    return high << 32 | word();
  }();
  return secret;
}

Result<MeshData> decode_obj(std::string_view name, std::span<const std::byte> file) {
  return ObjReader(name).read(as_text(file));
}

Result<MeshData> load_mesh(const std::filesystem::path& path, std::string_view name, int index,
                           std::span<const std::string> attributes) {
  const auto bytes = read_asset(path, name);
  if (!bytes) return tl::unexpected(bytes.error());
  if (is_serialized(*bytes)) return decode_serialized(name, *bytes, index);
  const bool is_ply = without_mark(as_text(*bytes)).starts_with("ply");
  return is_ply ? decode_ply(name, *bytes, attributes) : decode_obj(name, *bytes);
}

}  // namespace ls
