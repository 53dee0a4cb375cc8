// What `telesplat bench thesis` measures, step by step, and which data set stands for which of the thesis's.
#pragma once

#include <string>
#include <vector>

#include "common/core/result.h"

namespace telesplat::launcher {

/// A row of table 7.1 and what stands for its data set here.
struct ThesisMesh {
  const char* thesis_name;
  const char* thesis_triangles;
  double thesis_without_fps, thesis_with_fps;  ///< remote visualization
  const char* name;                            ///< of ours, and of its folder
  const char* file;                            ///< below the folder of data
  const char* why;                             ///< it stands for the thesis's
};
const std::vector<ThesisMesh>& thesis_meshes();

/// Chapter 6's couplings, in the order of its figures.
struct ThesisCoupling {
  const char* figure;    ///< "6.1"
  const char* coupling;  ///< as --coupling has it
  const char* title;
};
const std::vector<ThesisCoupling>& thesis_couplings();

/// Tables and figures: "7.1" to "7.4", and "6" for figures 6.1 to 6.3.
const std::vector<std::string>& thesis_parts();
/// "7.1,6", without blanks. Error: there is no such part.
Result<std::vector<std::string>> parse_parts(const std::string& text);

/// One thing to measure, in a folder of its own.
struct Step {
  std::string part, title;             ///< title: for people, and the key by which it is known
  std::string folder;                  ///< relative
  std::vector<std::string> arguments;  ///< of telesplat, without --out
  std::string direct;                  ///< file whose pictures are drawn without points instead; empty: none
  double expected_s = 0;
};

struct StepOptions {
  std::string data;  ///< folder of data sets
  bool quick = false;
  std::vector<std::string> parts;
};
/// In the order in which they are done: what is short first.
std::vector<Step> steps(const StepOptions& options);

/// Pixels of table 7.1's display and sampling (section 7.2).
inline constexpr int kThesisWidth = 2560, kThesisHeight = 1600;

/// The folder of data: $TELESPLAT_DATA, else telesplat-data in the user's cache folder.
std::string default_data_folder();

}  // namespace telesplat::launcher
