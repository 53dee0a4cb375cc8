#include "tools/telesplat/bench/codec/jpeg_xl.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>

#include "common/core/whole_file.h"
#include "common/net/service.h"
#include "tools/telesplat/movie/movie_target.h"
#include "tools/telesplat/movie/piped_process.h"

namespace telesplat::launcher {
namespace {

namespace fs = std::filesystem;

// A folder that goes with the program.
class Scratch {
 public:
  Scratch() {
    std::error_code error;
    path_ = (fs::temp_directory_path(error) / "telesplat-codec-XXXXXX").string();
    if (error || !mkdtemp(path_.data())) path_.clear();
  }
  ~Scratch() {
    std::error_code error;
    if (!path_.empty()) fs::remove_all(path_, error);
  }
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

// kind: "P5" for one channel, "P6" for three; most: the largest value, 65535 for two bytes a value.
Result<size_t> coded_bits(const char* kind, int most, const image::DepthImage& image,
                          const std::vector<uint8_t>& bytes) {
  static const Scratch scratch;
  if (scratch.path().empty()) return Error{"no temporary folder can be made for cjxl"};
  const std::string from = scratch.path() + "/tile.pnm", to = scratch.path() + "/tile.jxl";
  std::string picture = fmt::format("{}\n{} {}\n{}\n", kind, image.width, image.height, most);
  picture.append(bytes.begin(), bytes.end());
  if (const Status s = write_whole(from, picture); !s) return s.error();
  auto process = PipedProcess::start(find_program("cjxl"), {from, to, "-d", "0", "-e", "3"});
  if (!process) return process.error();
  const int code = process->finish([] { return net::stop_requested(); });
  if (code != 0) return Error{fmt::format("cjxl ended with code {}: {}", code, process->last_error_line())};
  std::error_code error;
  const auto size = fs::file_size(to, error);
  if (error) return Error{fmt::format("{}: {}", to, error.message())};
  return 8 * size_t(size);
}

Result<size_t> depth_bits(const image::DepthImage& image) {
  std::vector<uint8_t> upper, lower;
  for (const uint32_t d : image.depth) {
    upper.insert(upper.end(), {uint8_t(d >> 16), uint8_t(d >> 8)});
    lower.push_back(uint8_t(d));
  }
  const auto whole = coded_bits("P6", 255, image, depth_bytes(image));
  const auto first = coded_bits("P5", 65535, image, upper), second = coded_bits("P5", 255, image, lower);
  for (const auto* r : {&whole, &first, &second})
    if (!*r) return r->error();
  return std::min(*whole, *first + *second);
}

}  // namespace

std::string why_no_jpeg_xl() {
  return find_program("cjxl").empty() ? "cjxl is not installed (Debian: libjxl-tools)" : "";
}

Result<PlaneBits> jpeg_xl_bits(const image::DepthImage& image) {
  std::vector<uint8_t> normals;
  for (const uint16_t n : image.normal) normals.insert(normals.end(), {uint8_t(n >> 8), uint8_t(n), 0});
  const auto depth = depth_bits(image);
  const auto colour = coded_bits("P6", 255, image, colour_bytes(image));
  const auto normal = coded_bits("P6", 255, image, normals);
  for (const auto* r : {&depth, &colour, &normal})
    if (!*r) return r->error();
  return PlaneBits{*depth, *colour, *normal};
}

}  // namespace telesplat::launcher
