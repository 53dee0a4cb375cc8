#include "services/sampler/tiles/replay_file.h"

#include <fmt/format.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "common/codec/depth_codec.h"
#include "common/core/whole_file.h"

namespace telesplat::sampler {
namespace {
constexpr uint64_t kMaxBytes = 1u << 30;
}

Status write_replay(const std::string& path, const Replay& replay) {
  const auto stream = codec::encode(replay.frame);
  const nlohmann::ordered_json head{
      {"width", replay.frame.width}, {"height", replay.frame.height}, {"row_cost_s", replay.row_cost_s}};
  std::ofstream out(path, std::ios::binary);
  out << head.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace) << '\n';
  out.write(reinterpret_cast<const char*>(stream.data()), std::streamsize(stream.size()));
  out.close();
  if (!out) return Error{path + ": cannot be written"};
  return ok_status();
}

Result<Replay> read_replay(const std::string& path) {
  const auto content = read_whole(path, kMaxBytes);
  if (!content) return content.error();
  const std::string& all = *content;
  const size_t end = all.find('\n');
  const auto head = nlohmann::json::parse(all.substr(0, end == all.npos ? 0 : end), nullptr, false);
  if (!head.is_object() || !head.contains("width") || !head.contains("height") || !head.contains("row_cost_s") ||
      !head["width"].is_number_integer() || !head["height"].is_number_integer() || !head["row_cost_s"].is_array())
    return Error{path + ": does not begin with a line of JSON that has width, height and row_cost_s"};
  Replay out;
  for (const auto& cost : head["row_cost_s"]) {
    const double v = cost.is_number() ? cost.get<double>() : -1;
    if (!(v >= 0) || !std::isfinite(v))
      return Error{fmt::format("{}: row_cost_s holds {}, which is no cost", path, cost.dump().substr(0, 32))};
    out.row_cost_s.push_back(v);
  }
  const auto* data = reinterpret_cast<const uint8_t*>(all.data());
  auto frame = codec::decode({data + end + 1, all.size() - end - 1});
  if (!frame) return Error{fmt::format("{}: {}", path, frame.error().text)};
  out.frame = std::move(*frame);
  if (out.frame.width != head["width"] || out.frame.height != head["height"] ||
      out.row_cost_s.size() != size_t(out.frame.height))
    return Error{fmt::format("{}: says {}x{} and {} rows, holds a frame of {}x{}", path, head["width"].dump(),
                             head["height"].dump(), out.row_cost_s.size(), out.frame.width, out.frame.height)};
  return out;
}

}  // namespace telesplat::sampler
