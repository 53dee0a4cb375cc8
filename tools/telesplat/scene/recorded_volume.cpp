#include "tools/telesplat/scene/recorded_volume.h"

#include <fmt/format.h>

#include <toml++/toml.h>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "common/volume/session.h"
#include "tools/telesplat/record/csv_line.h"

namespace telesplat::launcher {
namespace {

constexpr size_t kMaxEpochs = 1'000'000;
constexpr size_t kMaxLine = volume::kMaxTransferText * 2 + (1 << 14);  // quotes double, numbers beside it

Status read_session(const std::string& path, RecordedVolume& out) {
  try {
    const toml::table table = toml::parse_file(path);
    const auto& scene = table["scene"];
    const auto text = [&](const char* key) { return scene[key].value_or(std::string()); };
    out.file = text("file");
    out.options.raw = text("raw");
    out.options.transfer = text("tf");
    out.options.lit = text("lighting") != "off";
    out.mesh.room_size_m = scene["room_size"].value_or(out.mesh.room_size_m);
    out.mesh.up = scene["up"].value_or(out.mesh.up);
    if (!(out.mesh.room_size_m >= 1e-3 && out.mesh.room_size_m <= 1e3))
      return Error{fmt::format("{}: room_size is {} m, limits are 0.001..1000", path, out.mesh.room_size_m)};
  } catch (const toml::parse_error& e) {
    return Error{fmt::format("{}:{}: {}", path, e.source().begin.line, e.description())};
  }
  return ok_status();
}

Result<double> number(const std::string& text) {
  double value = 0;
  const auto end = text.data() + text.size();
  const auto read = std::from_chars(text.data(), end, value);
  if (read.ec != std::errc() || read.ptr != end || !std::isfinite(value))
    return Error{fmt::format("\"{}\", not a number", text.substr(0, 40))};
  return value;
}

Status read_epochs(const std::string& path, RecordedVolume& out) {
  std::ifstream in(path);
  std::string line;
  if (!in || !std::getline(in, line)) return Error{fmt::format("{}: is empty", path)};
  const auto names = csv_fields(line).value_or(std::vector<std::string>{});
  const auto column = [&](const char* name) {
    return size_t(std::find(names.begin(), names.end(), name) - names.begin());
  };
  const size_t epoch = column("epoch"), step = column("volume.step"), transfer = column("transfer");
  for (const auto& [at, name] : {std::pair{epoch, "epoch"}, {step, "volume.step"}, {transfer, "transfer"}})
    if (at == names.size()) return Error{fmt::format("{}: has no column {}", path, name)};
  for (size_t row = 2; std::getline(in, line); ++row) {
    const auto wrong = [&](const std::string& what) { return Error{fmt::format("{}:{}: {}", path, row, what)}; };
    if (line.size() > kMaxLine) return wrong(fmt::format("a line of more than {} bytes", kMaxLine));
    if (out.epochs.size() == kMaxEpochs) return wrong(fmt::format("more than {} epochs", kMaxEpochs));
    const auto fields = csv_fields(line);
    if (!fields) return wrong("a quoted text that does not end");
    if (fields->size() != names.size())
      return wrong(fmt::format("{} values instead of {}", fields->size(), names.size()));
    const auto e = number((*fields)[epoch]), s = number((*fields)[step]);
    if (!e) return wrong("epoch is " + e.error().text);
    if (!s) return wrong("volume.step is " + s.error().text);
    if (!(*e >= 0 && *e < 9e15)) return wrong(fmt::format("epoch is {}, limits are 0..9e15", *e));
    if (!(*s >= 0 && *s < volume::kMaxSteps))
      return wrong(fmt::format("volume.step is {}, limits are 0..{}", *s, volume::kMaxSteps - 1));
    out.epochs[uint64_t(*e)] = {(*fields)[transfer], int(*s)};
  }
  return ok_status();
}

}  // namespace

Result<RecordedVolume::Epoch> RecordedVolume::at(EpochId epoch) const {
  if (epochs.empty()) return Epoch{};
  const auto found = epochs.find(epoch.value);
  if (found != epochs.end()) return found->second;
  return Error{fmt::format("{}/epochs.csv: has no epoch {}; it holds {} to {}", directory, epoch.value,
                           epochs.begin()->first, epochs.rbegin()->first)};
}

Result<RecordedVolume> read_recorded_volume(const std::string& directory) {
  RecordedVolume out;
  out.directory = directory;
  if (const Status s = read_session(directory + "/session.toml", out); !s) return s.error();
  std::error_code error;
  if (const std::string path = directory + "/epochs.csv"; std::filesystem::exists(path, error))
    if (const Status s = read_epochs(path, out); !s) return s.error();
  return out;
}

}  // namespace telesplat::launcher
