// Decodes compressed and coloured pixels of DICOM files by GDCM. In the program telesplat-import only: codecs may crash
// on hostile files.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "common/core/result.h"

namespace telesplat::data {

/// All frames of a file, one after the other, row by row, in native byte order.
struct DicomFrames {
  int columns = 0, rows = 0, frames = 0;
  int bytes = 0;  ///< per pixel
  std::vector<char> pixels;
};

/// Unpacks JPEG, JPEG-LS, JPEG 2000 and RLE, and makes grey of RGB and YBR (Rec. 601 luma, 8 bits). Values are as
/// stored: not rescaled. Error: GDCM cannot read the file.
Result<DicomFrames> decode_dicom(std::string_view content, const std::string& path);

}  // namespace telesplat::data
