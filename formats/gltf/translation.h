// Translates the objects of a glTF file to elements of Mitsuba's XML format. Each kind of object has a .cpp
// file of its own. A transform named to_world maps the object's space to the space of the scene.
#pragma once

#include <array>
#include <map>
#include <memory>
#include <numbers>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "formats/gltf/buffers.h"
#include "formats/made_files.h"
#include "formats/read.h"
#include "formats/xml/document.h"

namespace ls::scene::gltf {

inline constexpr double kDegrees = 180 / std::numbers::pi;  // degrees per radian

// The scene as translated so far.
struct Translation {
  AssetSource& assets;
  Report& report;
  Item root;
  Buffers buffers;
  Element scene;
  std::size_t elements = 0;  // number of elements in `scene`
  bool has_light = false;
  std::set<std::string> warned;                // texts of warnings that are given once per file
  std::map<const Value*, std::string> images;  // file name of each image read so far

  std::set<std::string> ids;

  std::string fresh_id(std::string name);  // returns the name, with a number appended if it is taken
  void add(Element e);                     // adds `e` to the scene; reports an error above kMaxElements
  void warn_once(const Item& at, std::string text);
};

// The moment at which animations are evaluated, and the animations that have an effect. read_poses() (in
// motion.cpp) returns the pose of each animated node at that moment.
struct Moment {
  std::optional<double> seconds;  // time in the animations; nullopt: animations have no effect
  std::string animation;          // name of an animation; empty: the first one; "*": all
};
struct Pose {
  std::optional<std::array<double, 3>> translation, scale;
  std::optional<std::array<double, 4>> rotation;
  // Weights of morph targets; nullptr: no animation sets them.
  std::shared_ptr<const std::vector<double>> weights;
};
using Poses = std::map<const Value*, Pose>;  // pose of each animated node
Poses read_poses(Translation& t, const Moment& moment);

// In motion.cpp: add_targets() and add_skin() change the positions and normals of `mesh`, which was read from
// `primitive`. They return false if the file is wrong, which has been reported.
//
// add_targets() adds each morph target, multiplied by its weight.
bool add_targets(Translation& t, const Item& primitive, const std::vector<double>& weights, MadeMesh& mesh);
// add_skin() transforms each corner (vertex) of the mesh by the weighted mean of its joints' matrices. It
// reverses the winding of a triangle if these means mirror most of its corners. `joints`: the matrix of each
// joint, from the space of the stored mesh to the world.
bool add_skin(Translation& t, const Item& primitive, const std::vector<Transform>& joints, MadeMesh& mesh);

// In placing.cpp: functions that make transforms. composed() and local_transform() are described there.
Transform composed(const Vec3& move, const std::array<double, 4>& rotation, const Vec3& scale);
Transform matrix_of(const std::array<double, 16>& by_columns);
Transform local_transform(const Item& node, const Pose& pose);
// glTF's cameras and lights look along -z of `to_world`, ours along +z. Returns our transform, with +y up and
// without scale and shear. nullopt: `to_world` is degenerate.
std::optional<Transform> facing(const Transform& to_world);
Transform looking(const Vec3& eye, const Vec3& target);

struct Box {
  Vec3 low{{1e300, 1e300, 1e300}}, high{{-1e300, -1e300, -1e300}};
  void include(const Vec3& p);
  void include(const Box& other, const Transform& to_world);
  bool is_empty() const { return low[0] > high[0]; }
};

// Relative tolerance of bounds: programs compute in single precision, so that a number which is meant to be a
// bound may lie a few units of its last place (2^-23) beyond it.
inline constexpr double kSingle = 1e-6;
// Returns x, or the nearer bound if x is beyond 0 or 1 by no more than kSingle. In textures.cpp.
double share(double x);

// In textures.cpp: a value that is a constant, or the product of a constant and images.
struct Source {
  std::array<double, 3> factor{1, 1, 1};
  std::vector<Element> images;  // textures that `factor` is multiplied by
  bool is_constant() const { return images.empty(); }
  bool is_factor_one() const { return factor == std::array<double, 3>{1, 1, 1}; }
  bool is(double x) const { return is_constant() && factor == std::array<double, 3>{x, x, x}; }
};
enum class Part { colour, red, green, blue, alpha, normal };
// Returns the texture that `info` refers to. `info` is a member of a material, such as "baseColorTexture".
// nullopt: there is none, or it is wrong, which has been reported.
std::optional<Element> texture(Translation& t, const Item& info, Part part);
// Returns the index n of the set of texture coordinates, TEXCOORD_n, that `info` names.
std::size_t uv_set(const Item& info);
// Each returns the product of a factor (a number or a colour) and a texture; either may be missing.
Source number_source(Translation& t, const Item& factor, double fallback, const Item& info, Part part);
Source colour_source(Translation& t, const std::array<double, 3>& factor, const Item& info);
// Adds the value to `parent` as the parameter `name`. With a threshold above 0 the parameter is 1 where the
// value is at least the threshold, else 0.
void give(Element& parent, std::string_view name, const Source& source, const Span& at, double threshold = 0);
Element vertex_attribute(std::string_view name, const Span& at);

// In materials.cpp: a translated material. A material of the file is translated once for each MeshKind, since
// the result depends on whether the mesh has vertex colours and opacities.
struct Material {
  std::string id;        // id of the bsdf
  std::string interior;  // id of the medium within; empty: none
  std::optional<Element> light;
  std::size_t uv_set = 0;
};
struct MeshKind {
  bool colours = false, opacities = false;  // true if the vertices have them
  auto operator<=>(const MeshKind&) const = default;
};
class Materials {
 public:
  explicit Materials(Translation& t) : t_(t) {}
  // Returns the translated material for meshes of this kind. `index`: the member "material" of a primitive,
  // which may be missing. Material::uv_set does not depend on `kind`.
  const Material& of(const Item& index, const MeshKind& kind);
  bool uses_opacity(const Item& index) const;
  std::size_t uv_set(const Item& index);

 private:
  Translation& t_;
  std::map<std::pair<const Value*, MeshKind>, Material> known_;
};

// In meshes.cpp: adds meshes to the scene.
class Meshes {
 public:
  Meshes(Translation& t, Materials& materials) : t_(t), materials_(materials) {}
  struct Use {
    Item mesh, node;
    Transform to_world;
    // The weights of the mesh's morph targets, owned by Stage; nullptr: the targets have no effect.
    const std::vector<double>* weights = nullptr;
    // The matrices of the joints of the mesh's skin (see add_skin()), owned by Stage; nullptr: the mesh has
    // no skin. With a skin to_world is the identity.
    const std::vector<Transform>* joints = nullptr;
  };
  // Adds all uses of meshes to the scene. Several uses of one mesh become instances where possible.
  void add(const std::vector<Use>& uses);
  const Box& box() const { return box_; }

 private:
  struct Surface {
    std::string file;
    Material material;
    Box box;
    bool flat = false;  // true if the vertices have no normals
    std::string label;
    Span at;
  };
  std::vector<Surface> read(const Use& use);
  std::optional<Surface> read_primitive(const Item& primitive, const Use& use);
  Element shape(const Surface& s);

  Translation& t_;
  Materials& materials_;
  std::size_t bytes_ = 0;  // size of the files of all meshes, in bytes
  // Number of primitives and morph targets read. Those of a mesh count again for each skin and each list of
  // weights that the mesh is used with.
  std::size_t parts_ = 0;
  Box box_;
};

// In nodes.cpp: a node that has a light or a camera, and the transform of the node to the world.
struct Standing {
  Item node;
  Transform to_world;
};
struct Stage {
  std::vector<Meshes::Use> meshes;
  std::vector<Standing> lights, cameras;
  // The matrices of joints, by skin; and the weights of morph targets, where equal lists are stored once. The
  // pointers of Meshes::Use point to entries of these two.
  std::map<const Value*, std::vector<Transform>> skins;
  std::set<std::vector<double>> weights;
};
Stage read_nodes(Translation& t, const Poses& poses);

// In ignored.cpp: warns of what the file has and no function here reads, once for each kind of it.
void warn_of_ignored(Translation& t);

// In lights.cpp: translates a light and adds it to the scene.
void add_light(Translation& t, const Standing& light);

// In camera.cpp: adds the camera with this name (empty: the first one); if there is none, adds a camera that
// frames `box`.
void add_camera(Translation& t, const std::vector<Standing>& cameras, const std::string& name,
                const Box& box);

}  // namespace ls::scene::gltf
