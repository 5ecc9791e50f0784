// Reads the files and data that a glTF file refers to: its URIs, its buffers, and the numbers of its
// accessors.
#pragma once

#include <cstdint>
#include <initializer_list>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "formats/gltf/value.h"
#include "formats/read.h"

namespace ls::scene::gltf {

// The value of a "uri" in a glTF file: the name of a file beside the glTF file, or a data URI, which contains
// the data itself.
struct Uri {
  bool is_data = false;
  std::string text;  // if is_data: the decoded bytes of the data URI; otherwise the name of the file
};

// Parses a "uri". nullopt: it is neither a valid file name nor a valid data URI; an error has been reported.
std::optional<Uri> read_uri(const Item& uri);

// The numbers of an accessor, which is a list of elements (such as vectors) of `width` numbers each.
template <class T>
struct Numbers {
  std::size_t width = 1;
  std::vector<T> values;
  std::size_t count() const { return values.size() / width; }
};

class Buffers {
 public:
  // `chunk`: the content of the BIN chunk of a .glb; it must outlive this object.
  Buffers(const Item& root, AssetSource& assets, std::optional<std::string_view> chunk)
      : root_(root), assets_(assets), chunk_(chunk) {}

  // These functions read from the buffers. `view` is the index of a buffer view, `accessor` the index of an
  // accessor, both as items of the JSON. `types` lists the accepted types of elements, such as "VEC3".
  // nullopt: bytes are missing, or the elements have another type; an error has been reported.
  std::optional<std::string_view> view(const Item& view);
  std::optional<Numbers<float>> floats(const Item& accessor, std::initializer_list<std::string_view> types);
  std::optional<std::vector<std::uint32_t>> indices(const Item& accessor);

 private:
  struct Layout;
  std::optional<std::string_view> buffer(const Item& index);
  std::optional<Layout> layout(const Item& accessor);
  std::optional<Layout> layout_in(const Item& owner, Layout like, std::size_t count, bool strided);
  template <class T>
  std::optional<std::vector<T>> read(const Item& accessor, const Layout& from);
  template <class T>
  bool read_sparse(const Item& sparse, const Layout& like, std::vector<T>& out);

  Item root_;
  AssetSource& assets_;
  std::optional<std::string_view> chunk_;
  // The content of the buffers read so far. The key is the JSON value of the buffer. nullopt: the buffer
  // could not be read.
  std::map<const Value*, std::optional<std::string>> read_;
  std::size_t total_bytes_ = 0, empty_elements_ = 0, read_numbers_ = 0;
};

}  // namespace ls::scene::gltf
