#include "client/viewer/hands/measurements.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <utility>

namespace telesplat::viewer {
namespace {

using Json = nlohmann::ordered_json;

scene::Measured measured(const Measurements::Row& row, const scene::Placement& placement) {
  std::vector<scene::ToldPlace> places;
  for (const auto& place : row) places.push_back(place.told);
  return scene::measure(places, placement);
}

// Makes a field of a table: in quotes if it has a comma, quotes or a line break.
std::string quoted(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == text.npos) return text;
  std::string out = "\"";
  for (const char c : text) out += c == '"' ? "\"\"" : std::string(1, c);
  return out + "\"";
}

std::string optional_text(const std::optional<double>& value) { return value ? fmt::format("{}", *value) : ""; }

}  // namespace

Result<uint64_t> Measurements::add(const Pick& pick, const SceneTerms& terms, EpochId epoch, double opacity) {
  size_t count = 0;
  for (const Row& row : rows_) count += row.size();
  if (count >= kMost) return Error{fmt::format("measure: there are {} places, limit {}", count, kMost)};
  placement_ = terms.placement;
  Place place{++last_, meaning_of(pick, terms), scene::to_arguments(probe_of(pick, epoch, opacity))};
  probes_.push_back(place.asked);
  if (std::exchange(begins_, false) || rows_.empty()) rows_.emplace_back();
  rows_.back().push_back(std::move(place));
  ++version_;
  return last_;
}

Status Measurements::remove(uint64_t number) {
  for (auto row = rows_.begin(); row != rows_.end(); ++row) {
    const auto place = std::find_if(row->begin(), row->end(), [&](const Place& p) { return p.number == number; });
    if (place == row->end()) continue;
    row->erase(place);
    if (row->empty()) {
      begins_ = begins_ || std::next(row) == rows_.end();
      rows_.erase(row);
    }
    ++version_;
    return ok_status();
  }
  return Error{fmt::format("measure: no place has the number {}", number)};
}

void Measurements::clear() {
  rows_.clear();
  begins_ = true;
  ++version_;
}

std::string Measurements::on_answer(const Probe& asked, bool found, const std::string& text) {
  for (Row& row : rows_)
    for (size_t i = 0; i < row.size(); ++i) {
      Place& place = row[i];
      if (place.asked.empty() || place.asked != asked) continue;
      place.asked.clear();
      const auto probed = found ? scene::probed_from_text(text) : Result<scene::Probed>(Error{text});
      if (probed)
        scene::refine(place.told, *probed, placement_);
      else
        place.told.estimate = probed.error().text;
      ++version_;
      std::string out = fmt::format("{}: {}", place.number, scene::place_text(placement_, place.told.data));
      if (place.told.error)
        out += " +- " + scene::length_text(std::strtod(fmt::format("{:.2g}", *place.told.error).c_str(), nullptr),
                                           placement_.unit);
      if (!place.told.estimate.empty()) out += ", an estimate: " + place.told.estimate;
      if (const std::string value = scene::value_text(place.told); !value.empty()) out += "; " + value;
      if (const std::string lengths = between(row, i); !lengths.empty()) out += "; " + lengths;
      return out;
    }
  return {};
}

std::string Measurements::between(const Row& row, size_t index) const {
  if (index == 0) return {};
  const scene::Measured m = measured(row, placement_);
  const uint64_t before = row[index - 1].number;
  std::string out = fmt::format("{} from {}", scene::length_text(m.distances[index - 1], placement_.unit), before);
  if (index >= 2 && std::isfinite(m.angles_deg[index - 2]))
    out += fmt::format(", {:.2f} degrees at {}", m.angles_deg[index - 2], before);
  return out;
}

std::string Measurements::list() const {
  Json places = Json::array();
  for (size_t r = 0; r < rows_.size(); ++r) {
    const scene::Measured m = measured(rows_[r], placement_);
    for (size_t i = 0; i < rows_[r].size(); ++i) {
      const Place& place = rows_[r][i];
      Json told{{"number", place.number}, {"row", r + 1}};
      told.update(scene::to_json(place.told, placement_));
      if (i > 0) told["distance"] = m.distances[i - 1];
      if (i > 0) told["between"] = between(rows_[r], i);
      if (i > 1 && std::isfinite(m.angles_deg[i - 2])) told["angle_deg"] = m.angles_deg[i - 2];
      if (!place.asked.empty()) told["pending"] = true;
      places.push_back(std::move(told));
    }
  }
  return Json{{"places", std::move(places)}, {"unit", placement_.unit}}.dump(-1, ' ', false,
                                                                             Json::error_handler_t::replace);
}

std::string Measurements::csv() const {
  std::string out =
      "number,row,x,y,z,place,unit,error,array,value,value_error,array_unit,distance,angle_deg,estimate\n";
  for (size_t r = 0; r < rows_.size(); ++r) {
    const scene::Measured m = measured(rows_[r], placement_);
    for (size_t i = 0; i < rows_[r].size(); ++i) {
      const scene::ToldPlace& p = rows_[r][i].told;
      const bool angle = i > 1 && std::isfinite(m.angles_deg[i - 2]);
      out += fmt::format("{},{},{},{},{},{},{},{},{},{},{},{},{},{},{}\n", rows_[r][i].number, r + 1, p.data.x,
                         p.data.y, p.data.z, quoted(scene::place_text(placement_, p.data)), quoted(placement_.unit),
                         optional_text(p.error), quoted(p.array), optional_text(p.value), optional_text(p.value_error),
                         quoted(p.array_unit), i > 0 ? fmt::format("{}", m.distances[i - 1]) : "",
                         angle ? fmt::format("{}", m.angles_deg[i - 2]) : "", quoted(p.estimate));
    }
  }
  return out;
}

}  // namespace telesplat::viewer
