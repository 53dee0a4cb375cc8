#include "tools/lab/make_volume/tree.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <memory>
#include <random>

#include "common/parallel/in_parallel.h"

namespace telesplat::made_volume {
namespace {

constexpr float kNeedle = 9000, kWood = 14000, kSoil = 18000, kPot = 30000, kGlass = 40000, kMetal = 60000;
constexpr float kNoise = 350;  // amplitude of the scanner's noise

// Everything is in the unit cube.
struct Capsule {  // tapered
  glm::vec3 a, b;
  float ra, rb, value;
};
struct Shell {  // a hollow ball; a solid one if thickness is its radius
  glm::vec3 centre;
  float radius, thickness, value;
};

struct Tree {
  std::vector<Capsule> capsules;
  std::vector<Shell> shells;
};

class Grower {
 public:
  explicit Grower(uint64_t seed) : random_(seed) {}

  Tree grow() {
    const glm::vec3 root(0.5f, 0.5f, 0.16f), top(0.5f, 0.5f, 0.92f);
    tree_.capsules.push_back({root, top, 0.016f, 0.004f, kWood});
    float z = 0.26f;
    for (int whorl = 0; z < 0.88f; ++whorl) {
      const float up = (z - 0.26f) / 0.62f, length = 0.36f * (1 - up) + 0.03f;
      const int branches = 13 - int(6 * up);
      for (int n = 0; n < branches; ++n) {
        const float angle =
            6.2831853f * (float(n) + 0.35f * between(-1, 1) + 0.5f * float(whorl % 2)) / float(branches);
        branch({0.5f, 0.5f, z + 0.008f * between(-1, 1)}, angle, length * between(0.85f, 1.05f), 0.5f * up - 0.1f);
      }
      z += 0.045f - 0.012f * up;
    }
    tree_.shells.push_back({top + glm::vec3(0, 0, 0.02f), 0.018f, 0.018f, kMetal});
    for (int ray = 0; ray < 10; ++ray) {
      const float angle = 0.62831853f * float(ray), reach = ray % 2 ? 0.028f : 0.05f;
      tree_.capsules.push_back({top + glm::vec3(0, 0, 0.02f),
                                top + glm::vec3(reach * std::sin(angle), 0, 0.02f + reach * std::cos(angle)), 0.008f,
                                0.001f, kMetal});
    }
    return std::move(tree_);
  }

 private:
  float between(float lo, float hi) { return std::uniform_real_distribution<float>(lo, hi)(random_); }

  void branch(const glm::vec3& from, float angle, float length, float rise) {
    const glm::vec3 out = glm::normalize(glm::vec3(std::cos(angle), std::sin(angle), rise));
    const glm::vec3 side = glm::normalize(glm::cross(out, glm::vec3(0, 0, 1)));
    const int joints = std::max(3, int(length * 60));
    glm::vec3 at = from;
    for (int j = 0; j < joints; ++j) {
      const float along = (float(j) + 1) / float(joints), radius = 0.0045f * (1 - 0.8f * along);
      const glm::vec3 to =
          from + out * (length * along) + glm::vec3(0, 0, -0.10f * length * along * along);  // it hangs
      tree_.capsules.push_back({at, to, radius + 0.0005f, radius, kWood});
      twig(to, glm::normalize(out + side * between(0.6f, 1.1f)), 0.055f * (1.15f - along));
      twig(to, glm::normalize(out - side * between(0.6f, 1.1f)), 0.055f * (1.15f - along));
      at = to;
    }
    if (length > 0.08f && between(0, 1) < 0.45f) {
      const float radius = between(0.016f, 0.026f);
      tree_.capsules.push_back({at, at - glm::vec3(0, 0, 0.012f), 0.001f, 0.001f, kMetal});
      tree_.shells.push_back({at - glm::vec3(0, 0, 0.012f + radius), radius, 0.0025f, kGlass});
    }
  }

  void twig(const glm::vec3& from, const glm::vec3& along, float length) {
    const glm::vec3 to = from + along * length;
    tree_.capsules.push_back({from, to, 0.0016f, 0.0008f, kWood});
    const int needles = std::max(6, int(length * 700));
    for (int n = 0; n < needles; ++n) {
      const glm::vec3 base = from + along * (length * (float(n) + between(0, 1)) / float(needles));
      const glm::vec3 away(between(-1, 1), between(-1, 1), between(-0.6f, 1));
      const glm::vec3 tip = base + glm::normalize(along * 0.9f + away) * 0.017f;
      tree_.capsules.push_back({base, tip, 0.0013f, 0.0006f, kNeedle});
    }
  }

  std::mt19937_64 random_;
  Tree tree_;
};

uint64_t mix(uint64_t h) {  // splitmix64
  h = (h ^ h >> 30) * 0xbf58476d1ce4e5b9;
  h = (h ^ h >> 27) * 0x94d049bb133111eb;
  return h ^ h >> 31;
}

// Share of a voxel that a surface covers, `inside` (unit cube) below it, for a scanner that blurs over a voxel.
float coverage(float inside, float voxel) { return std::clamp(inside / voxel + 0.5f, 0.0f, 1.0f); }

// The slices [z0, z1), drawn with everything that touches them.
class Slices {
 public:
  Slices(Scan& scan, int z0, int z1) : scan_(scan), z0_(z0), z1_(z1), voxel_(1.0f / float(scan.side)) {}

  void draw(const Capsule& c) {
    const float r = std::max(c.ra, c.rb) + voxel_;
    const glm::vec3 axis = c.b - c.a;
    const float length2 = std::max(glm::dot(axis, axis), 1e-12f);
    fill(glm::min(c.a, c.b) - r, glm::max(c.a, c.b) + r, [&](const glm::vec3& p) {
      const float t = std::clamp(glm::dot(p - c.a, axis) / length2, 0.0f, 1.0f);
      return c.value * coverage(c.ra + (c.rb - c.ra) * t - glm::distance(p, c.a + axis * t), voxel_);
    });
  }
  void draw(const Shell& s) {
    fill(s.centre - s.radius - voxel_, s.centre + s.radius + voxel_, [&](const glm::vec3& p) {
      const float d = glm::distance(p, s.centre);
      return s.value * std::min(coverage(s.radius - d, voxel_), coverage(d - (s.radius - s.thickness), voxel_));
    });
  }
  // A conical pot of earthenware with soil in it.
  void draw_pot() {
    fill(glm::vec3(0.3f, 0.3f, 0.03f), glm::vec3(0.7f, 0.7f, 0.19f), [&](const glm::vec3& p) {
      const float outer = 0.11f + 0.3f * (p.z - 0.04f), d = std::hypot(p.x - 0.5f, p.y - 0.5f);
      const float wall =
          std::min({coverage(outer - d, voxel_), coverage(p.z - 0.04f, voxel_), coverage(0.18f - p.z, voxel_)});
      const float hollow = std::min(coverage(outer - 0.012f - d, voxel_), coverage(p.z - 0.055f, voxel_));
      const float lumps = 0.004f * std::sin(90 * p.x) * std::sin(70 * p.y + 1);
      const float soil = std::min(hollow, coverage(0.165f + lumps - p.z, voxel_));
      return std::max(kPot * std::min(wall, 1 - hollow), kSoil * soil);
    });
  }
  void add_noise(uint64_t seed) {
    const size_t from = at(0, 0, z0_), to = at(0, 0, z1_);
    for (size_t i = from; i < to; ++i) {
      // The mean of two uniform numbers, around 0; negative values become 0, as scanners store them.
      const uint64_t h = mix((seed + i) * 0x9e3779b97f4a7c15);
      const float noise = (float(h >> 40) + float(h & 0xffffff)) * 0x1p-24f - 1;
      scan_.values[i] = uint16_t(std::clamp(float(scan_.values[i]) + kNoise * noise, 0.0f, 65535.0f));
    }
  }

 private:
  size_t at(int x, int y, int z) const {
    return (size_t(z) * size_t(scan_.side) + size_t(y)) * size_t(scan_.side) + size_t(x);
  }
  void fill(const glm::vec3& lo, const glm::vec3& hi, const auto& value) {
    const auto index = [&](float v, int last) { return std::clamp(int(v * float(scan_.side)), 0, last); };
    const int n = scan_.side - 1;
    const int from = std::max(z0_, index(lo.z, n)), to = std::min(z1_ - 1, index(hi.z, n) + 1);
    for (int z = from; z <= to; ++z)
      for (int y = index(lo.y, n); y <= std::min(n, index(hi.y, n) + 1); ++y)
        for (int x = index(lo.x, n); x <= std::min(n, index(hi.x, n) + 1); ++x) {
          uint16_t& v = scan_.values[at(x, y, z)];
          v = std::max(v, uint16_t(value((glm::vec3(x, y, z) + 0.5f) * voxel_)));
        }
  }

  Scan& scan_;
  int z0_, z1_;
  float voxel_;
};

}  // namespace

Scan make_tree(int side, uint64_t seed, const std::function<void(double)>& progress) {
  CHECK(side >= kMinSide && side <= kMaxSide);
  const Tree tree = Grower(seed).grow();
  Scan scan{side, std::vector<uint16_t>(size_t(side) * size_t(side) * size_t(side))};
  constexpr int kSlices = 8;  // drawn at a time
  const int parts = (side + kSlices - 1) / kSlices;
  std::atomic<int> done = 0;
  in_parallel(0, parts, [&](int part) {
    Slices slices(scan, part * kSlices, std::min(side, (part + 1) * kSlices));
    const float lo = float(part * kSlices) / float(side), hi = float((part + 1) * kSlices) / float(side),
                margin = 2.0f / float(side);
    for (const auto& c : tree.capsules) {
      const float r = std::max(c.ra, c.rb) + margin;
      if (std::max(c.a.z, c.b.z) + r >= lo && std::min(c.a.z, c.b.z) - r <= hi) slices.draw(c);
    }
    for (const auto& s : tree.shells)
      if (s.centre.z + s.radius + margin >= lo && s.centre.z - s.radius - margin <= hi) slices.draw(s);
    slices.draw_pot();
    slices.add_noise(seed);
    if (progress) progress(double(++done) / parts);
  });
  return scan;
}

Status write_scan(const Scan& scan, int bits, const std::string& path) {
  const auto ends = [&](const char* with) { return path.ends_with(with); };
  if (!ends(".nrrd") && !ends(".mha") && !ends(".raw"))
    return Error{fmt::format("{}: its name ends neither in .nrrd nor in .mha nor in .raw", path)};
  if (bits != 8 && bits != 16) return Error{fmt::format("{} bits a voxel: neither 8 nor 16", bits)};
  const int n = scan.side;
  std::string header;
  if (ends(".nrrd"))
    header = fmt::format(
        "NRRD0004\n# made by make-volume\ntype: {}\ndimension: 3\nspace: left-posterior-superior\nsizes: {} {} {}\n"
        "space directions: (1,0,0) (0,1,0) (0,0,1)\nkinds: domain domain domain\nendian: little\nencoding: raw\n"
        "space origin: (0,0,0)\n\n",
        bits == 8 ? "uint8" : "uint16", n, n, n);
  if (ends(".mha"))
    header = fmt::format(
        "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\nCompressedData = False\n"
        "TransformMatrix = 1 0 0 0 1 0 0 0 1\nOffset = 0 0 0\nElementSpacing = 1 1 1\nDimSize = {} {} {}\n"
        "ElementType = {}\nElementDataFile = LOCAL\n",
        n, n, n, bits == 8 ? "MET_UCHAR" : "MET_USHORT");
  const std::unique_ptr<FILE, int (*)(FILE*)> file(std::fopen(path.c_str(), "wb"), std::fclose);
  const auto failed = [&] { return Error{fmt::format("{}: cannot be written: {}", path, std::strerror(errno))}; };
  if (!file) return failed();
  if (std::fwrite(header.data(), 1, header.size(), file.get()) != header.size()) return failed();
  const size_t slice = size_t(n) * size_t(n);
  std::vector<uint8_t> bytes;
  for (size_t z = 0; z < size_t(n); ++z) {
    const uint16_t* from = scan.values.data() + z * slice;
    if (bits == 16) {
      if (std::fwrite(from, 2, slice, file.get()) != slice) return failed();
      continue;
    }
    bytes.resize(slice);
    for (size_t i = 0; i < slice; ++i) bytes[i] = uint8_t(from[i] >> 8);
    if (std::fwrite(bytes.data(), 1, slice, file.get()) != slice) return failed();
  }
  if (std::fflush(file.get()) != 0) return failed();
  return ok_status();
}

}  // namespace telesplat::made_volume
