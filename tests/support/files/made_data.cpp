#include "tests/support/files/made_data.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <tuple>

namespace telesplat::test {
namespace {

namespace fs = std::filesystem;

template <class T>
void put(std::string& out, T value) {
  out.append(reinterpret_cast<const char*>(&value), sizeof value);
}

}  // namespace

TemporaryFolder::TemporaryFolder() {
  std::string pattern = (fs::temp_directory_path() / "telesplat-test-XXXXXX").string();
  path_ = mkdtemp(pattern.data());
}
TemporaryFolder::~TemporaryFolder() {
  std::error_code error;
  fs::remove_all(path_, error);
}

void write_terrain(const std::string& path, int cells) {
  const int side = cells + 1;
  std::string out = fmt::format(
      "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float "
      "z\nproperty uchar red\n"
      "property uchar green\nproperty uchar blue\nelement face {}\nproperty list uchar int "
      "vertex_indices\nend_header\n",
      side * side, 2 * cells * cells);
  for (int j = 0; j < side; ++j)
    for (int i = 0; i < side; ++i) {
      const float x = float(i) / cells, y = float(j) / cells;
      const float z = 0.08f * std::sin(9 * x) * std::cos(7 * y) + 0.02f * std::sin(31 * x + 17 * y);
      put(out, x), put(out, y), put(out, z);
      put(out, uint8_t(80 + 150 * x)), put(out, uint8_t(200 - 900 * std::abs(z))), put(out, uint8_t(60 + 150 * y));
    }
  for (int j = 0; j < cells; ++j)
    for (int i = 0; i < cells; ++i) {
      const int a = j * side + i;
      for (const auto& [p, q, r] : {std::tuple{a, a + 1, a + side + 1}, {a, a + side + 1, a + side}})
        put(out, uint8_t(3)), put(out, p), put(out, q), put(out, r);
    }
  std::ofstream(path, std::ios::binary) << out;
}

void write_volume(const std::string& path, int side, double turn) {
  std::string out = fmt::format(
      "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\nDimSize = {0} {0} "
      "{0}\nElementSpacing = 1 1 1\nElementType = MET_UCHAR\nElementDataFile = LOCAL\n",
      side);
  const double angle = 2 * 3.14159265358979 * turn;
  const auto ball = [](double x, double y, double z, double radius) {
    return std::clamp((radius - std::sqrt(x * x + y * y + z * z)) / 0.25 + 0.5, 0.0, 1.0);
  };
  for (int k = 0; k < side; ++k)
    for (int j = 0; j < side; ++j)
      for (int i = 0; i < side; ++i) {
        const double x = 2.0 * i / (side - 1) - 1, y = 2.0 * j / (side - 1) - 1, z = 2.0 * k / (side - 1) - 1;
        const double large = 200 * ball(x, y, z, 0.45),
                     small = 140 * ball(x - 0.5 * std::cos(angle), y - 0.5 * std::sin(angle), z - 0.4, 0.3),
                     rod = 255 * std::clamp((0.12 - std::hypot(x, y)) / 0.08 + 0.5, 0.0, 1.0) * (std::abs(z) < 0.85);
        out += char(uint8_t(std::lround(std::max({large, small, rod}))));
      }
  std::ofstream(path, std::ios::binary) << out;
}

std::string read_text(const std::string& path) try {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
} catch (const std::ios_base::failure&) {
  return {};  // a process of /proc has ended meanwhile
}

}  // namespace telesplat::test
