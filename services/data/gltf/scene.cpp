#include "services/data/gltf/parts.h"

#include <glm/gtc/matrix_transform.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/gtc/type_ptr.hpp>

namespace telesplat::data::gltf {
namespace {

constexpr size_t kNone = ~size_t{0};

std::vector<size_t> node_list(const Json& of, const char* key, size_t nodes) {
  std::vector<size_t> out;
  for (const Json& node : member(of, key)) {
    const size_t i = node.is_number_unsigned() ? node.get<size_t>() : kNone;
    if (i >= nodes) refuse("names node {}, there are {}", node.dump(), nodes);
    out.push_back(i);
  }
  return out;
}

glm::dmat4 transform(glm::dvec3 move, glm::dquat turn, glm::dvec3 scale) {
  return glm::scale(glm::translate(glm::dmat4(1), move) * glm::mat4_cast(turn), scale);
}

glm::dmat4 local_transform(const Json& node) {
  if (member(node, "matrix").is_array()) {
    const auto m = numbers<16>(node, "matrix", {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1});
    return glm::make_mat4(m.data());
  }
  const auto t = numbers<3>(node, "translation", {0, 0, 0}), s = numbers<3>(node, "scale", {1, 1, 1});
  const auto r = numbers<4>(node, "rotation", {0, 0, 0, 1});
  return transform({t[0], t[1], t[2]}, {r[3], r[0], r[1], r[2]}, {s[0], s[1], s[2]});
}

class Scene {
 public:
  explicit Scene(Document& document)
      : document_(document),
        nodes_(document.list("nodes")),
        parents_(nodes_.size(), kNone),
        children_(nodes_.size()),
        world_(nodes_.size()) {
    for (size_t i = 0; i < nodes_.size(); ++i)
      for (const size_t child : children_[i] = node_list(element(nodes_, i), "children", nodes_.size())) {
        if (parents_[child] != kNone) refuse("node {} has two parents, {} and {}", child, parents_[child], i);
        parents_[child] = i;
      }
  }

  std::map<size_t, std::vector<Placement>> place() {
    std::vector<size_t> open = roots();
    std::vector<bool> seen(nodes_.size(), false);
    while (!open.empty()) {
      const size_t i = open.back();
      open.pop_back();
      const Json& node = element(nodes_, i);
      if (seen[i] || member(extension(node, "KHR_node_visibility"), "visible") == false) continue;
      seen[i] = true;
      open.insert(open.end(), children_[i].rbegin(), children_[i].rend());
      if (const auto mesh = index(node, "mesh")) place(node, i, out_[*mesh]);
    }
    if (nodes_.empty())
      for (size_t mesh = 0; mesh < document_.list("meshes").size(); ++mesh) out_[mesh].emplace_back();
    return std::move(out_);
  }

 private:
  std::vector<size_t> roots() const {
    const Json& scene = document_.at("scenes", index(document_.root(), "scene").value_or(0));
    if (scene.is_object()) {
      auto out = node_list(scene, "nodes", nodes_.size());
      return {out.rbegin(), out.rend()};  // the last element is visited first
    }
    std::vector<size_t> out;
    for (size_t i = nodes_.size(); i-- > 0;)
      if (parents_[i] == kNone) out.push_back(i);
    return out;
  }

  const glm::dmat4& world(size_t node) {
    std::vector<size_t> chain;
    for (size_t i = node; i != kNone && !world_[i]; i = parents_[i]) {
      if (chain.size() > nodes_.size()) refuse("node {} lies below itself", node);
      chain.push_back(i);
    }
    for (; !chain.empty(); chain.pop_back()) {
      const size_t i = chain.back();
      const glm::dmat4 own = local_transform(element(nodes_, i));
      world_[i] = parents_[i] == kNone ? own : *world_[parents_[i]] * own;
    }
    return *world_[node];
  }

  void place(const Json& node, size_t i, std::vector<Placement>& out) {
    Placement placement{world(i), nullptr, morph_weights(node)};
    if (const auto skin = index(node, "skin")) placement.joints = joints(*skin);
    const Json& moved = member(extension(node, "EXT_mesh_gpu_instancing"), "attributes");
    if (!moved.is_object()) return out.push_back(std::move(placement));
    const auto values = [&](const char* key, int width) {
      const auto accessor = index(moved, key);
      return accessor ? document_.values(*accessor, width) : Values{};
    };
    const Values t = values("TRANSLATION", 3), r = values("ROTATION", 4), s = values("SCALE", 3);
    const size_t count = std::max({t.count(), r.count(), s.count()});
    const auto fits = [count](const Values& v) { return v.width == 0 || v.count() == count; };
    if (!fits(t) || !fits(r) || !fits(s)) refuse("node {}: its instances have lists of different lengths", i);
    for (size_t k = 0; k < count; ++k) {
      const auto three = [k](const Values& v, double d) {
        return v.width ? glm::dvec3(glm::make_vec3(v[k])) : glm::dvec3(d);
      };
      const glm::dquat turn = r.width ? glm::dquat(r[k][3], r[k][0], r[k][1], r[k][2]) : glm::dquat(1, 0, 0, 0);
      out.push_back(placement);
      out.back().to_world = placement.to_world * transform(three(t, 0), turn, three(s, 1));
    }
  }

  std::shared_ptr<const std::vector<glm::dmat4>> joints(size_t skin) {
    auto& known = skins_[skin];
    if (known) return known;
    const Json& json = document_.at("skins", skin);
    const auto nodes = node_list(json, "joints", nodes_.size());
    const auto accessor = index(json, "inverseBindMatrices");
    const Values inverse = accessor ? document_.values(*accessor, 16) : Values{};
    if (nodes.empty() || (accessor && inverse.count() < nodes.size()))
      refuse("skin {} has {} joints and {} matrices", skin, nodes.size(), inverse.count());
    auto out = std::make_shared<std::vector<glm::dmat4>>();
    for (size_t j = 0; j < nodes.size(); ++j)
      out->push_back(accessor ? world(nodes[j]) * glm::dmat4(glm::make_mat4(inverse[j])) : world(nodes[j]));
    return known = std::move(out);
  }

  Document& document_;
  const Json& nodes_;
  std::vector<size_t> parents_;
  std::vector<std::vector<size_t>> children_;
  std::vector<std::optional<glm::dmat4>> world_;
  std::map<size_t, std::shared_ptr<const std::vector<glm::dmat4>>> skins_;
  std::map<size_t, std::vector<Placement>> out_;
};

}  // namespace

std::map<size_t, std::vector<Placement>> place_meshes(Document& document) { return Scene(document).place(); }

std::vector<double> morph_weights(const Json& of) {
  std::vector<double> out;
  for (const Json& weight : member(of, "weights")) out.push_back(weight.is_number() ? weight.get<double>() : 0);
  return out;
}

}  // namespace telesplat::data::gltf
