// Data sets that tests make, and a folder for them.
#pragma once

#include <string>

namespace telesplat::test {

/// A folder that goes when the object does.
class TemporaryFolder {
 public:
  TemporaryFolder();
  ~TemporaryFolder();
  const std::string& path() const { return path_; }
  std::string operator/(const std::string& name) const { return path_ + "/" + name; }

 private:
  std::string path_;
};

/// Writes a coloured, bumpy terrain of 2 * cells^2 triangles as binary PLY.
void write_terrain(const std::string& path, int cells = 100);

/// Writes a volume of `side`^3 voxels as MetaImage (.mha), 8 bit: two soft balls of 200 and 140 that pass into each
/// other, a rod of 255 through them, 0 around. `turn` moves the smaller ball around the larger: 0 to 1 is once around.
void write_volume(const std::string& path, int side = 40, double turn = 0);

std::string read_text(const std::string& path);

}  // namespace telesplat::test
