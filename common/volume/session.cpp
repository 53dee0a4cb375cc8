#include "common/volume/session.h"

#include <fmt/format.h>

#include <array>
#include <cmath>

namespace telesplat::volume {
namespace {

constexpr double kMaxValue = 1e30;  // limit of data: float volumes hold it, and differences stay finite
constexpr double kMaxStepsPerSecond = 1000;
constexpr int kMaxParts = 1024;

std::string placement_name(int row, int column) { return fmt::format("volume.m{}{}", row, column); }

// Takes numbers out of the map by name; remembers the first that is missing or beyond its limits.
class ParameterReader {
 public:
  explicit ParameterReader(const std::map<std::string, double>& parameters) : parameters_(parameters) {}

  double number(const std::string& name, double least, double most) {
    const auto found = parameters_.find(name);
    if (found == parameters_.end()) {
      fail(fmt::format("{} is missing", name));
      return least;
    }
    if (found->second >= least && found->second <= most) return found->second;  // false for NaN, too
    fail(fmt::format("{} is {}, limits are {}..{}", name, found->second, least, most));
    return least;
  }
  int whole(const std::string& name, int least, int most) {
    const double value = number(name, least, most);
    if (value != std::floor(value))
      fail(fmt::format("{} is {}, but takes whole numbers {}..{}", name, value, least, most));
    return int(value);
  }
  void fail(std::string text) {
    if (complaint_.empty()) complaint_ = std::move(text);
  }
  const std::string& complaint() const { return complaint_; }

 private:
  const std::map<std::string, double>& parameters_;
  std::string complaint_;
};

}  // namespace

std::map<std::string, double> to_parameters(const Session& s) {
  std::map<std::string, double> out{{"volume.size.x", s.grid.size[0]},
                                    {"volume.size.y", s.grid.size[1]},
                                    {"volume.size.z", s.grid.size[2]},
                                    {"volume.levels.lo", s.levels.lo},
                                    {"volume.levels.step", s.levels.step},
                                    {"volume.levels.count", s.levels.count},
                                    {"volume.range.lo", s.range.lo},
                                    {"volume.range.hi", s.range.hi},
                                    {"volume.range.typical-lo", s.range.typical_lo},
                                    {"volume.range.typical-hi", s.range.typical_hi},
                                    {"volume.hounsfield", s.range.hounsfield ? 1 : 0},
                                    {"volume.lit", s.lit ? 1 : 0},
                                    {"volume.steps", s.steps},
                                    {"volume.step", s.step},
                                    {"volume.steps-per-s", s.steps_per_s},
                                    {"volume.part", s.part},
                                    {"volume.parts", s.parts}};
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 4; ++column) out[placement_name(row, column)] = s.grid.index_to_room[column][row];
  return out;
}

std::map<std::string, std::string> to_facts(const Session& s) {
  std::map<std::string, std::string> out{{"transfer", to_text(s.transfer)}};
  if (!s.array.empty()) out["volume_array"] = s.array;
  return out;
}

Result<Session> read_session(const std::map<std::string, double>& parameters,
                             const std::map<std::string, std::string>& facts) {
  ParameterReader in(parameters);
  Session s;
  s.grid.size = {in.whole("volume.size.x", 1, kMaxSide), in.whole("volume.size.y", 1, kMaxSide),
                 in.whole("volume.size.z", 1, kMaxSide)};
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 4; ++column)
      s.grid.index_to_room[column][row] = in.number(placement_name(row, column), -1e9, 1e9);
  s.levels.lo = in.number("volume.levels.lo", -kMaxValue, kMaxValue);
  s.levels.step = in.number("volume.levels.step", 1 / kMaxValue, kMaxValue);
  s.levels.count = in.whole("volume.levels.count", 1, kMaxLevels);
  s.range.lo = in.number("volume.range.lo", -kMaxValue, kMaxValue);
  s.range.hi = in.number("volume.range.hi", s.range.lo, kMaxValue);
  s.range.typical_lo = in.number("volume.range.typical-lo", s.range.lo, s.range.hi);
  s.range.typical_hi = in.number("volume.range.typical-hi", s.range.typical_lo, s.range.hi);
  s.range.hounsfield = in.whole("volume.hounsfield", 0, 1) == 1;
  s.lit = in.whole("volume.lit", 0, 1) == 1;
  s.steps = in.whole("volume.steps", 1, kMaxSteps);
  s.step = in.whole("volume.step", 0, s.steps - 1);
  s.steps_per_s = in.number("volume.steps-per-s", 0, kMaxStepsPerSecond);
  s.parts = in.whole("volume.parts", 1, std::min(kMaxParts, s.grid.size[2]));  // every part has at least one slice
  s.part = in.whole("volume.part", 0, s.parts - 1);
  if (!in.complaint().empty()) return Error{"volume session: " + in.complaint()};
  if (const Status valid = validate(s.grid); !valid) return valid.error();

  const auto transfer = facts.find("transfer");
  if (transfer == facts.end()) return Error{"volume session: the fact transfer is missing"};
  auto parsed = parse_transfer(transfer->second, s.range);
  if (!parsed) return parsed.error();
  s.transfer = std::move(*parsed);
  if (const auto array = facts.find("volume_array"); array != facts.end())
    s.array = array->second.substr(0, kMaxArrayName);
  return s;
}

}  // namespace telesplat::volume
