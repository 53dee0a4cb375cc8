#include "services/data/import/vtk_complaint.h"

#include <algorithm>

namespace telesplat::data {

std::string first_complaint(const std::string& output) {
  const size_t error = output.find("ERROR:");
  if (error == std::string::npos) return "";
  size_t start = output.find("): ", error);
  start = start == std::string::npos ? error + 6 : start + 3;
  std::string line = output.substr(start, std::min(output.find('\n', start), start + 200) - start);
  std::replace_if(
      line.begin(), line.end(), [](char c) { return static_cast<unsigned char>(c) < ' '; }, ' ');
  return line;
}

}  // namespace telesplat::data
