#include "services/data/texture/bake.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <vector>

#include "common/image/srgb.h"
#include "common/parallel/in_parallel.h"
#include "services/data/base/numbering.h"

namespace telesplat::data {

namespace {

struct Edge {
  uint32_t low, high;
  Edge(uint32_t a, uint32_t b) : low(std::min(a, b)), high(std::max(a, b)) {}
};
constexpr uint32_t kNone = Numbering<Edge>::kNone;

constexpr float kShortestEdge = 1.5f;         // texels: longer ones may be halved
constexpr float kShortestNearestEdge = 0.5f;  // for textures that are not interpolated
constexpr float kVisible = 6;                 // 8-bit steps: smaller differences are not worth a vertex
constexpr int kMostSamples = 2048;            // along a triangle's edge, when searching for differences

glm::vec3 codes(glm::vec3 linear) {
  glm::vec3 out;
  for (int i = 0; i < 3; ++i) {
    const float c = std::clamp(linear[i], 0.0f, 1.0f);
    out[i] = 255 * (c <= 0.0031308f ? 12.92f * c : 1.055f * std::pow(c, 1 / 2.4f) - 0.055f);
  }
  return out;
}

uint32_t mean_colour(uint32_t a, uint32_t b) {
  uint32_t out = 0;
  for (const int shift : {16, 8, 0}) out = out << 8 | ((a >> shift & 255) + (b >> shift & 255) + 1) / 2;
  return out;
}

// Numbers positions, so that edges are halved on both sides of a seam.
std::vector<uint32_t> number_positions(const std::vector<glm::dvec3>& positions) {
  Numbering<glm::dvec3> numbers(positions.size());
  std::vector<uint32_t> out;
  out.reserve(positions.size());
  for (const glm::dvec3& p : positions) out.push_back(numbers(p + glm::dvec3(0.0)));  // -0 is 0
  return out;
}

class Baker {
 public:
  Baker(Mesh& mesh, TextureUse use, uint64_t most_triangles)
      : mesh_(mesh), use_(std::move(use)), most_(most_triangles), place_(number_positions(mesh.positions)) {
    places_ = uint32_t(mesh_.positions.size());
    for (size_t v = 0; v < use_.uv.size(); ++v) {
      const glm::vec2 uv = use_.uv[v];
      if (!(std::abs(uv.x) <= kMaxUv && std::abs(uv.y) <= kMaxUv)) use_.texture[v] = kNoTexture;
    }
    if (mesh_.colours.empty()) mesh_.colours.assign(mesh_.positions.size(), 0xffffff);
  }

  std::string bake() {
    complete_normals();
    settled_.assign(mesh_.indices.size() / 3, false);
    while (pass()) {
    }
    colour();
    if (longest_left_ == 0) return {};
    return fmt::format(
        "the texture's detail ends at {} triangles (--texture-detail {}); where it was left out, an edge spans up to "
        "{:.0f} texels",
        mesh_.indices.size() / 3, most_, longest_left_);
  }

 private:
  // Computes missing normals now, since seams of textures double vertices: shading stays smooth across seams.
  void complete_normals() {
    mesh_.normals.resize(mesh_.positions.size(), glm::vec3(0));
    const auto absent = [&](size_t v) { return mesh_.normals[v] == glm::vec3(0); };
    std::vector<glm::dvec3> sums(mesh_.positions.size(), glm::dvec3(0));  // by number of position
    for (size_t t = 0; t < mesh_.indices.size() / 3; ++t) {
      const auto& p = mesh_.positions;
      const glm::dvec3 n = glm::cross(p[corner(t, 1)] - p[corner(t, 0)], p[corner(t, 2)] - p[corner(t, 0)]);
      for (int k = 0; k < 3; ++k) sums[place_[corner(t, k)]] += n;
    }
    for (size_t v = 0; v < mesh_.positions.size(); ++v) {
      const glm::dvec3 n = sums[place_[v]];
      if (absent(v) && glm::dot(n, n) > 0) mesh_.normals[v] = glm::vec3(glm::normalize(n));
    }
  }

  uint32_t corner(size_t t, int k) const { return mesh_.indices[3 * t + size_t(k)]; }
  // Null: no texture, or corners with different ones.
  const Texture* texture_of(size_t t) const {
    const uint32_t a = use_.texture[corner(t, 0)];
    if (a == kNoTexture || use_.texture[corner(t, 1)] != a || use_.texture[corner(t, 2)] != a) return nullptr;
    return use_.textures[a].get();
  }
  float edge_texels(const Texture& texture, size_t t, int k) const {
    return texture.texels(use_.uv[corner(t, k)], use_.uv[corner(t, (k + 1) % 3)]);
  }
  static float shortest(const Texture& texture) { return texture.nearest() ? kShortestNearestEdge : kShortestEdge; }

  // True if colours in the triangle differ visibly from those between its corners. `longest`: its longest edge, texels.
  bool differs(const Texture& texture, size_t t, float longest) const {
    glm::vec2 uv[3];
    glm::vec3 at[3];
    for (int k = 0; k < 3; ++k) uv[k] = use_.uv[corner(t, k)], at[k] = codes(texture.sample(uv[k]));
    const int n = std::clamp(int(std::ceil(texture.nearest() ? 2 * longest : longest)), 2, kMostSamples);
    for (int i = 0; i <= n; ++i)
      for (int j = 0; i + j <= n; ++j) {
        const float b = float(i) / float(n), c = float(j) / float(n), a = 1 - b - c;
        const glm::vec3 off =
            glm::abs(codes(texture.sample(uv[0] * a + uv[1] * b + uv[2] * c)) - (at[0] * a + at[1] * b + at[2] * c));
        if (std::max({off.r, off.g, off.b}) > kVisible) return true;
      }
    return false;
  }

  // Poles of spheres have such triangles; they are invisible.
  bool is_a_line(size_t t) const {
    const uint32_t a = place_[corner(t, 0)], b = place_[corner(t, 1)], c = place_[corner(t, 2)];
    return a == b || b == c || c == a;
  }

  // Returns the edges to be halved for the triangle's own sake: a bit for each corner 0, 1, 2, for the edge after it.
  uint8_t wishes(size_t t) const {
    const Texture* texture = texture_of(t);
    if (!texture || texture->plain() || is_a_line(t)) return 0;
    uint8_t bits = 0;
    float longest = 0;
    for (int k = 0; k < 3; ++k) {
      const float length = edge_texels(*texture, t, k);
      longest = std::max(longest, length);
      if (length > shortest(*texture)) bits |= uint8_t(1 << k);
    }
    return bits && differs(*texture, t, longest) ? bits : 0;
  }

  double size_of(size_t t) const {
    double longest = 0;
    for (int k = 0; k < 3; ++k)
      longest =
          std::max(longest, glm::distance(mesh_.positions[corner(t, k)], mesh_.positions[corner(t, (k + 1) % 3)]));
    return longest;
  }

  // Halves the wanted edges, as far as there is room. False: no edge is wanted, or no room is left.
  bool pass() {
    const size_t triangles = mesh_.indices.size() / 3;
    std::vector<uint8_t> wish(triangles, 0);
    in_parallel(size_t{0}, triangles, [&](size_t t) {
      if (!settled_[t]) wish[t] = wishes(t);
    });
    std::vector<std::pair<double, uint32_t>> wanted;
    for (size_t t = 0; t < triangles; ++t) {
      settled_[t] = settled_[t] || wish[t] == 0;
      if (wish[t]) wanted.emplace_back(-size_of(t), uint32_t(t));
    }
    if (wanted.empty()) return false;
    // Halving a triangle's three edges adds at most three triangles for it and one for each neighbour.
    const size_t room = most_ > triangles ? size_t(most_ - triangles) / 6 : 0;
    const bool enough = wanted.size() <= room;
    if (!enough) {
      std::nth_element(wanted.begin(), wanted.begin() + std::ptrdiff_t(room), wanted.end());
      if (room < 16 || room < wanted.size() / 64) return leave_out(wanted);
      wanted.resize(room);
    }
    marked_ = Numbering<Edge>();
    for (const auto& [size, t] : wanted)
      for (int k = 0; k < 3; ++k)
        if (wish[t] >> k & 1) marked_({place_[corner(t, k)], place_[corner(t, (k + 1) % 3)]});
    divide_all(triangles);
    places_ += uint32_t(marked_.keys().size());
    return true;
  }

  bool leave_out(const std::vector<std::pair<double, uint32_t>>& wanted) {
    for (const auto& [size, t] : wanted)
      for (int k = 0; k < 3; ++k) longest_left_ = std::max(longest_left_, edge_texels(*texture_of(t), t, k));
    return false;
  }

  void divide_all(size_t triangles) {
    middles_ = Numbering<Edge>();
    first_middle_ = uint32_t(mesh_.positions.size());
    for (size_t t = 0; t < triangles; ++t) {
      uint32_t middle[3];
      bool any = false;
      for (int k = 0; k < 3; ++k) {
        const uint32_t a = corner(t, k), b = corner(t, (k + 1) % 3);
        const uint32_t number = marked_.find({place_[a], place_[b]});
        middle[k] = number == kNone ? kNone : middle_of(a, b, places_ + number);
        any |= number != kNone;
      }
      if (any) divide(t, middle);
    }
  }

  uint32_t middle_of(uint32_t a, uint32_t b, uint32_t place) {
    const auto next = uint32_t(mesh_.positions.size());
    const uint32_t v = first_middle_ + middles_({a, b});
    if (v != next) return v;
    mesh_.positions.push_back((mesh_.positions[a] + mesh_.positions[b]) * 0.5);
    const auto unit = [](glm::vec3 n) { return glm::dot(n, n) > 0 ? glm::normalize(n) : n; };
    mesh_.normals.push_back(unit(unit(mesh_.normals[a]) + unit(mesh_.normals[b])));
    mesh_.colours.push_back(mean_colour(mesh_.colours[a], mesh_.colours[b]));
    use_.uv.push_back((use_.uv[a] + use_.uv[b]) * 0.5f);
    use_.texture.push_back(use_.texture[a] == use_.texture[b] ? use_.texture[a] : kNoTexture);
    place_.push_back(place);
    return v;
  }

  // The first piece takes the triangle's place; all pieces keep its winding.
  void divide(size_t t, const uint32_t (&middle)[3]) {
    const uint32_t c[3] = {corner(t, 0), corner(t, 1), corner(t, 2)};
    const int count = (middle[0] != kNone) + (middle[1] != kNone) + (middle[2] != kNone);
    if (count == 3) {
      replace(t, {middle[0], middle[1], middle[2]});
      for (int k = 0; k < 3; ++k) add(t, {c[k], middle[k], middle[(k + 2) % 3]});
    } else if (count == 1) {
      int k = 0;
      while (middle[k] == kNone) ++k;
      replace(t, {c[k], middle[k], c[(k + 2) % 3]});
      add(t, {middle[k], c[(k + 1) % 3], c[(k + 2) % 3]});
    } else {
      int whole = 0;  // the edge that stays, from corner a to b; o is opposite
      while (middle[whole] != kNone) ++whole;
      const uint32_t a = c[whole], b = c[(whole + 1) % 3], o = c[(whole + 2) % 3];
      const uint32_t at_b = middle[(whole + 1) % 3], at_a = middle[(whole + 2) % 3];
      replace(t, {o, at_a, at_b});
      // Cut the remaining quadrilateral along its shorter diagonal.
      const auto& p = mesh_.positions;
      if (glm::distance(p[a], p[at_b]) <= glm::distance(p[b], p[at_a])) {
        add(t, {a, b, at_b});
        add(t, {a, at_b, at_a});
      } else {
        add(t, {a, b, at_a});
        add(t, {b, at_b, at_a});
      }
    }
  }
  void replace(size_t t, const uint32_t (&corners)[3]) { std::copy(corners, corners + 3, &mesh_.indices[3 * t]); }
  void add(size_t t, const uint32_t (&corners)[3]) {
    mesh_.indices.insert(mesh_.indices.end(), corners, corners + 3);
    settled_.push_back(settled_[t]);
  }

  void colour() {
    // A vertex covers about as many texels as the mean length of its edges.
    std::vector<float> length(mesh_.positions.size(), 0), edges(mesh_.positions.size(), 0);
    for (size_t t = 0; t < mesh_.indices.size() / 3; ++t) {
      const Texture* texture = texture_of(t);
      for (int k = 0; texture && k < 3; ++k) {
        const float texels = edge_texels(*texture, t, k);
        for (const uint32_t v : {corner(t, k), corner(t, (k + 1) % 3)}) length[v] += texels, edges[v] += 1;
      }
    }
    in_parallel(size_t{0}, mesh_.positions.size(), [&](size_t v) {
      if (use_.texture[v] == kNoTexture || edges[v] == 0) return;
      const Texture& texture = *use_.textures[use_.texture[v]];
      const float texels = length[v] / edges[v] / kShortestEdge;
      // Edges that were left long because nothing is visible along them do not blur their ends.
      const int level = longest_left_ > 0 && texels > 1.5f ? int(std::lround(std::log2(texels))) : 0;
      const glm::vec3 c = linear_of(mesh_.colours[v]) * texture.sample(use_.uv[v], level);
      mesh_.colours[v] =
          image::srgb_of_linear(c.r) << 16 | image::srgb_of_linear(c.g) << 8 | image::srgb_of_linear(c.b);
    });
  }

  Mesh& mesh_;
  TextureUse use_;
  const uint64_t most_;
  std::vector<uint32_t> place_;  // per vertex: the number of its position
  uint32_t places_ = 0;
  std::vector<bool> settled_;  // per triangle: no more detail is visible in it
  /// By positions: edges to halve; by vertices: edges whose middles are the vertices from first_middle_ on.
  Numbering<Edge> marked_, middles_;
  uint32_t first_middle_ = 0;
  float longest_left_ = 0;  // texels of the longest edge that should have been halved
};

}  // namespace

std::string bake_textures(Mesh& mesh, TextureUse use, uint64_t most_triangles) {
  CHECK(use.uv.size() == mesh.positions.size() && use.texture.size() == mesh.positions.size());
  CHECK(mesh.scalars.empty());
  return Baker(mesh, std::move(use), most_triangles).bake();
}

}  // namespace telesplat::data
