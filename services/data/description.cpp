#include "services/data/description.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/core/within.h"

namespace telesplat::data {
namespace {

// Replaces control characters: a file's name may hold any, and a terminal would obey them.
std::string plain(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](char c) { return static_cast<unsigned char>(c) < ' ' || c == 127; }, '?');
  return text;
}

}  // namespace

Description::Description(const std::string& what, std::string title) : title_(std::move(title)) { json["what"] = what; }

std::string Description::table() const {
  size_t width = 0;
  for (const auto& [label, text] : rows_) width = std::max(width, label.size());
  std::string out = plain(title_) + "\n";
  for (const auto& [label, text] : rows_) out += fmt::format("  {:{}}  {}\n", label, width, plain(text));
  return out;
}

std::string Description::to_json() const {
  return json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

std::string bytes_text(uint64_t bytes) {
  if (bytes < 100'000) return fmt::format("{} bytes", bytes);
  return bytes < 1'000'000'000 ? fmt::format("{:.1f} MB", double(bytes) / 1e6)
                               : fmt::format("{:.2f} GB", double(bytes) / 1e9);
}

std::string range_text(double lo, double hi) {
  constexpr int kDigits = 6, kMostDigits = 17;
  const double largest = std::max(std::abs(lo), std::abs(hi));
  const double more = hi > lo ? std::ceil(std::log10(largest / (hi - lo))) - 1 : 0;
  const int digits = kDigits + int(within(more, 0.0, double(kMostDigits - kDigits)));
  return fmt::format("{:.{}g} .. {:.{}g}", lo, digits, hi, digits);
}

std::string vector_text(const glm::dvec3& v) {
  const glm::dvec3 u = v + 0.0;  // no -0
  return fmt::format("({:.8g}, {:.8g}, {:.8g})", u.x, u.y, u.z);
}
std::string extent_text(const glm::dvec3& v) { return fmt::format("{:.6g} x {:.6g} x {:.6g}", v.x, v.y, v.z); }

nlohmann::ordered_json vector_json(const glm::dvec3& v) { return {v.x, v.y, v.z}; }
nlohmann::ordered_json box_json(const geometry::DBox& box) {
  return {{"lo", vector_json(box.lo)}, {"hi", vector_json(box.hi)}};
}

void describe_room(Description& out, const geometry::Box& box_room, const std::string& up, const std::string& reason) {
  const glm::dvec3 lo(box_room.lo), hi(box_room.hi), size = hi - lo;
  out.row("in the room", fmt::format("{:.3f} x {:.3f} x {:.3f} m (wide, high, deep), from ({:.3f}, {:.3f}, {:.3f}) to "
                                     "({:.3f}, {:.3f}, {:.3f})",
                                     size.x, size.y, size.z, lo.x, lo.y, lo.z, hi.x, hi.y, hi.z));
  auto& room = out.json["room"] = box_json({lo, hi});
  room["unit"] = "m";
  if (up.empty()) return;
  out.row("up", fmt::format("{} ({})", up, reason));
  room["up"] = up;
  room["up_reason"] = reason;
}

}  // namespace telesplat::data
