#include "common/geometry/trajectory.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string_view>

#include "common/core/utf8.h"
#include "common/core/whole_file.h"

namespace telesplat::geometry {
namespace {

constexpr size_t kMaxSamples = 10'000'000, kMaxLine = 1 << 16;
constexpr std::array<std::string_view, 8> kColumns{"t_s", "px", "py", "pz", "qw", "qx", "qy", "qz"};
constexpr const char* kWanted = "t_s, px, py, pz, qw, qx, qy, qz";

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kBlank = " \t\r\"";
  const size_t from = text.find_first_not_of(kBlank);
  return from == text.npos ? "" : text.substr(from, text.find_last_not_of(kBlank) - from + 1);
}

std::vector<std::string_view> split(std::string_view line) {
  std::vector<std::string_view> out;
  for (;;) {
    const size_t comma = line.find(',');
    out.push_back(trimmed(line.substr(0, comma)));
    if (comma == line.npos) return out;
    line.remove_prefix(comma + 1);
  }
}

// Natural order of names: viewer-2 before viewer-10.
bool comes_before(std::string_view a, std::string_view b) { return a.size() != b.size() ? a.size() < b.size() : a < b; }

class Reader {
 public:
  explicit Reader(const std::string& path) : path_(path) {}

  Result<std::vector<Trajectory::Sample>> read() {
    if (const Status s = read_header(); !s) return s.error();
    for (; next_line(); ++number_)
      if (!trimmed(line_).empty())
        if (const Status s = read_row(); !s) return s.error();
    if (in_.bad() || line_.size() > kMaxLine) return wrong(fmt::format("longer than {} bytes", kMaxLine));
    if (samples_.empty()) return Error{fmt::format("{}: holds no samples", path_)};
    return std::move(samples_);
  }

 private:
  Error wrong(const std::string& what) const { return Error{fmt::format("{}:{}: {}", path_, number_, what)}; }

  // Reads a line of limited length, so that an endless one does not fill the memory.
  bool next_line() {
    line_.clear();
    for (char c = 0; in_.get(c);) {
      if (c == '\n') return true;
      line_ += c;
      if (line_.size() > kMaxLine) return false;
    }
    return !line_.empty() && !in_.bad();
  }

  Status read_header() {
    std::error_code error;
    if (!std::filesystem::exists(path_, error))
      return Error{fmt::format("{}: no such file (orbit and still are built in; else a CSV file with the columns {})",
                               path_, kWanted)};
    if (const Status s = check_readable(path_, kMostTableBytes); !s) return s;
    in_.open(path_);
    if (!in_ || !next_line())
      return Error{fmt::format("{}: cannot be read as a trajectory, a CSV file with the columns {}", path_, kWanted)};
    std::string_view header = line_;
    if (header.starts_with("\xef\xbb\xbf")) header.remove_prefix(3);
    const auto names = split(header);
    columns_ = names.size();
    for (size_t i = 0; i < kColumns.size(); ++i) {
      const auto found = std::find(names.begin(), names.end(), kColumns[i]);
      if (found == names.end())
        return wrong(fmt::format("no column {} in the header \"{}\"; a trajectory has the columns {}", kColumns[i],
                                 printable(header), kWanted));
      at_[i] = size_t(found - names.begin());
    }
    const auto viewer = std::find(names.begin(), names.end(), "viewer");
    if (viewer != names.end()) viewer_at_ = size_t(viewer - names.begin());
    ++number_;
    return ok_status();
  }

  static std::string printable(std::string_view text) {
    std::string out = to_utf8(text.substr(0, 120));
    std::replace_if(
        out.begin(), out.end(), [](char c) { return static_cast<unsigned char>(c) < ' '; }, '?');
    return text.size() > 120 ? out + "..." : out;
  }

  Status read_row() {
    const auto fields = split(line_);
    if (fields.size() != columns_)
      return wrong(fmt::format("{} values instead of the {} of the header", fields.size(), columns_));
    if (viewer_at_ && !is_of_viewer(fields[*viewer_at_])) return ok_status();
    double v[8];
    for (size_t i = 0; i < 8; ++i) {
      const std::string_view text = fields[at_[i]];
      const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), v[i]);
      if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(v[i]))
        return wrong(fmt::format("{} is \"{}\", not a finite number", kColumns[i], printable(text)));
    }
    const glm::dquat q(v[4], v[5], v[6], v[7]);
    if (!(std::abs(glm::length(q) - 1.0) <= 0.05))
      return wrong(fmt::format("quaternion has length {:.3f} instead of 1", glm::length(q)));
    for (const double p : {v[1], v[2], v[3]})
      if (std::abs(p) > 1e6) return wrong(fmt::format("position {} m is farther than 1e6 m from the origin", p));
    if (!samples_.empty() && v[0] <= samples_.back().t_s)
      return wrong(fmt::format("time {} s is not after {} s", v[0], samples_.back().t_s));
    if (samples_.size() == kMaxSamples) return Error{fmt::format("{}: more than {} samples", path_, kMaxSamples)};
    samples_.push_back({v[0], {{v[1], v[2], v[3]}, glm::normalize(q)}});
    return ok_status();
  }

  // Only the rows of one viewer count: of the first by name, even if its rows begin later.
  bool is_of_viewer(std::string_view name) {
    if (viewer_ && comes_before(*viewer_, name)) return false;
    if (!viewer_ || name != *viewer_) {
      samples_.clear();
      viewer_ = name;
    }
    return true;
  }

  const std::string& path_;
  std::ifstream in_;
  std::string line_;
  int number_ = 1;
  size_t columns_ = 0;
  std::array<size_t, 8> at_{};
  std::optional<size_t> viewer_at_;
  std::optional<std::string> viewer_;
  std::vector<Trajectory::Sample> samples_;
};

}  // namespace

Result<std::vector<Trajectory::Sample>> read_samples(const std::string& path) { return Reader(path).read(); }

Result<Trajectory> Trajectory::read_csv(const std::string& path) {
  auto samples = read_samples(path);
  if (!samples) return samples.error();
  return of(std::move(*samples));
}

Trajectory Trajectory::orbit(double radius_m, double height_m, double period_s, const glm::dvec3& centre) {
  Trajectory out;
  out.orbit_radius_m_ = radius_m;
  out.orbit_height_m_ = height_m;
  out.orbit_period_s_ = period_s;
  out.orbit_centre_ = centre;
  return out;
}

Trajectory Trajectory::still(const Pose& pose) { return of({{0.0, pose}}); }

Trajectory Trajectory::of(std::vector<Sample> samples) {
  CHECK(!samples.empty());
  Trajectory out;
  out.samples_ = std::move(samples);
  return out;
}

Pose Trajectory::at(double t_s) const {
  if (samples_.empty()) {
    const double angle = t_s / orbit_period_s_ * 2.0 * 3.14159265358979323846;
    const glm::dvec3 aside(orbit_radius_m_ * std::sin(angle), orbit_height_m_, orbit_radius_m_ * std::cos(angle));
    return look_at(orbit_centre_ + aside, orbit_centre_);
  }
  if (repeats_ && duration_s() > 0 && t_s > duration_s()) t_s = std::fmod(t_s, duration_s());
  // Sample times count from the first one.
  const double t = t_s + samples_.front().t_s;
  const auto after =
      std::upper_bound(samples_.begin(), samples_.end(), t, [](double v, const Sample& s) { return v < s.t_s; });
  if (after == samples_.begin()) return samples_.front().pose;
  if (after == samples_.end()) return samples_.back().pose;
  const Sample &a = *(after - 1), &b = *after;
  const double f = (t - a.t_s) / (b.t_s - a.t_s);
  return {glm::mix(a.pose.position_room, b.pose.position_room, f),
          glm::normalize(glm::slerp(a.pose.orientation, b.pose.orientation, f))};
}

double Trajectory::duration_s() const { return samples_.empty() ? 0.0 : samples_.back().t_s - samples_.front().t_s; }

Status write_trajectory(const std::string& path, const std::vector<Trajectory::Sample>& samples) {
  std::ofstream out(path);
  out << "t_s,px,py,pz,qw,qx,qy,qz\n";
  for (const auto& [t_s, pose] : samples) {
    const auto& p = pose.position_room;
    const auto& q = pose.orientation;
    out << fmt::format("{:.6f},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g}\n", t_s, p.x, p.y, p.z, q.w, q.x, q.y,
                       q.z);
  }
  out.close();
  if (out) return ok_status();
  Error error{fmt::format("{}: cannot be written: {}", path, std::strerror(errno))};
  std::error_code ignored;
  if (std::filesystem::is_regular_file(path, ignored)) std::filesystem::remove(path, ignored);  // removes half a file
  return error;
}

Pose look_at(const glm::dvec3& eye, const glm::dvec3& target) {
  const glm::dvec3 away = eye - target;
  if (!(glm::length(away) > 1e-12)) return {eye, {1, 0, 0, 0}};
  const glm::dvec3 back = glm::normalize(away);
  const glm::dvec3 up = std::abs(back.y) > 0.999 ? glm::dvec3(0, 0, -1) : glm::dvec3(0, 1, 0);
  const glm::dvec3 right = glm::normalize(glm::cross(up, back));
  return {eye, glm::normalize(glm::quat_cast(glm::dmat3(right, glm::cross(back, right), back)))};
}

Pose default_pose() { return look_at({0.0, 0.4, 0.62}, {0.0, 0.0, 0.0}); }

}  // namespace telesplat::geometry
