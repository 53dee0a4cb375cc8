// What people say of a volume's files that these do not tell, or tell several of.
#pragma once

#include <string>

namespace telesplat::data {

struct VolumeLayout {
  std::string raw;      ///< --raw: "256x256x256:u8[:sx,sy,sz][:skip=bytes]"; empty: files tell themselves
  std::string series;   ///< --series: which of a DICOM folder's; empty: the one of most slices
  std::string spacing;  ///< --spacing: "x,y,z" of voxels; empty: the files'
  std::string array;    ///< --array: which of a file that names them; empty: the one that it marks, else the first

  /// All in one, for names of stores; empty: nothing is said.
  std::string text() const {
    const std::string out = raw + "\n" + series + "\n" + spacing + "\n" + array;
    return out == "\n\n\n" ? "" : out;
  }
};

}  // namespace telesplat::data
