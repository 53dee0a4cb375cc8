#include "tools/telesplat/report/parts.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <map>
#include <optional>

#include "common/image/file.h"
#include "common/image/jpeg.h"
#include "tools/telesplat/movie/contact_sheet.h"

namespace telesplat::launcher {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

constexpr int kShownWidth = 480, kComparedWidth = 1440;  // pixels
constexpr int kQuality = 82;

struct Picture {
  std::string path, name;  ///< name: "worst", ... for pictures of --verify; empty: a displayed frame
  uint64_t frame = 0;
};

// frame-000123.png, verify-worst-000123.png
std::optional<Picture> picture_of(const fs::path& path) {
  const std::string name = path.filename().string();
  if (!name.ends_with(".png")) return {};
  const size_t dash = name.rfind('-');
  if (dash == name.npos) return {};
  Picture out{path.string(), {}, 0};
  const char* const end = name.data() + name.size() - 4;
  const auto read = std::from_chars(name.data() + dash + 1, end, out.frame);
  if (read.ec != std::errc() || read.ptr != end) return {};
  if (name.starts_with("frame-") && dash == 5) return out;
  if (!name.starts_with("verify-") || dash < 8) return {};
  out.name = name.substr(7, dash - 7);
  return out;
}

std::vector<Picture> pictures_in(const std::string& directory, bool compared) {
  std::vector<Picture> out;
  std::error_code error;
  for (fs::directory_iterator entry(directory + "/images", error), end; !error && entry != end; entry.increment(error))
    if (auto p = picture_of(entry->path());
        p && p->name.empty() != compared && lies_within(directory, "images/" + entry->path().filename().string()))
      out.push_back(*p);
  std::sort(out.begin(), out.end(), [](const Picture& a, const Picture& b) { return a.frame < b.frame; });
  return out;
}

// Chooses evenly, the first and the last among them.
template <class T>
std::vector<T> evenly(const std::vector<T>& all, size_t most) {
  if (all.size() <= most) return all;
  std::vector<T> out;
  for (size_t k = 0; k < most; ++k) out.push_back(all[most > 1 ? k * (all.size() - 1) / (most - 1) : 0]);
  return out;
}

// Returns when the first viewer displayed each frame.
std::map<uint64_t, double> moments(const RunTables& t) {
  std::map<uint64_t, double> out;
  if (!t.frames) return out;
  const auto& numbers = t.frames->numbers("frame");
  const auto& viewers = t.frames->texts("viewer");
  for (size_t row = 0; row < numbers.size(); ++row)
    if (numbers[row] >= 0 && std::isfinite(t.frame_s[row]) && viewers[row] == viewers.front())
      out.emplace(uint64_t(numbers[row]), t.frame_s[row]);
  return out;
}

class Gallery {
 public:
  Gallery(const RunTables& tables, size_t bytes) : moments_(moments(tables)), bytes_left_(bytes) {}

  ordered_json show(const std::vector<Picture>& pictures, int width) {
    ordered_json out = ordered_json::array();
    for (const Picture& p : pictures) {
      const auto view = image::read_view(p.path);
      if (!view) {
        ++left_out_;
        continue;
      }
      const image::View small = small_picture(*view, width);
      const auto jpeg = image::encode_jpeg(small.colour, small.width, small.height, kQuality);
      if (jpeg.size() * 4 / 3 > bytes_left_) {
        ++left_out_;
        continue;
      }
      bytes_left_ -= jpeg.size() * 4 / 3;
      ordered_json one{
          {"frame", p.frame},
          {"src", "data:image/jpeg;base64," + base64({reinterpret_cast<const char*>(jpeg.data()), jpeg.size()})}};
      if (!p.name.empty()) one["name"] = p.name;
      if (const auto at = moments_.find(p.frame); at != moments_.end()) one["t"] = std::round(at->second * 1e4) / 1e4;
      out.push_back(std::move(one));
    }
    return out;
  }
  size_t left_out() const { return left_out_; }

 private:
  std::map<uint64_t, double> moments_;
  size_t bytes_left_, left_out_ = 0;
};

}  // namespace

std::string base64(std::string_view bytes) {
  constexpr const char* kSigns = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  out.reserve((bytes.size() + 2) / 3 * 4);
  for (size_t i = 0; i < bytes.size(); i += 3) {
    const auto byte = [&](size_t k) { return i + k < bytes.size() ? uint32_t(uint8_t(bytes[i + k])) : 0u; };
    const uint32_t three = byte(0) << 16 | byte(1) << 8 | byte(2);
    for (size_t k = 0; k < 4; ++k) out += i + k <= bytes.size() ? kSigns[three >> (18 - 6 * k) & 63] : '=';
  }
  return out;
}

ordered_json pictures_json(const std::string& directory, const RunTables& tables, const PageLimits& limits,
                           size_t bytes) {
  const auto shown = pictures_in(directory, false), compared = pictures_in(directory, true);
  Gallery gallery(tables, bytes);
  ordered_json out{{"of", shown.size()}};
  out["compared"] = gallery.show(evenly(compared, 3), kComparedWidth);
  out["shown"] = gallery.show(evenly(shown, limits.pictures), kShownWidth);
  out["left_out"] = gallery.left_out();
  return out;
}

}  // namespace telesplat::launcher
