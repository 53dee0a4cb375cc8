#include "common/metrics/run_record.h"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "common/image/depth_image.h"

namespace telesplat::metrics {
namespace {

constexpr size_t kMaxRows = 50'000'000;
constexpr double kRawBytesPerSlicePixel = 4, kRawBytesPerPoint = 12;

std::string shortest(double v) { return fmt::format("{:.9g}", v); }

void write_text(FILE* file, const std::string& text) {
  if (file) std::fwrite(text.data(), 1, text.size(), file);
}

// A text as CSV has it (RFC 4180); line ends become spaces, so that a row is a line.
std::string csv_quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"') out += '"';
    out += c == '\n' || c == '\r' ? ' ' : c;
  }
  return out + '"';
}

// How evenly samplers were kept busy: (most - least) / mean.
nlohmann::ordered_json busy_spread(const std::map<std::string, double>& busy_s) {
  double least = 1e300, most = 0, sum = 0;
  auto by_name = nlohmann::ordered_json::object();
  for (const auto& [name, s] : busy_s) {
    least = std::min(least, s);
    most = std::max(most, s);
    sum += s;
    by_name[name] = std::round(s * 1e6) / 1e6;
  }
  const double spread = sum > 0 ? (most - least) * double(busy_s.size()) / sum : 0;
  return {{"spread", std::round(spread * 1e4) / 1e4}, {"busy_s", by_name}};
}

}  // namespace

Result<std::unique_ptr<RunRecord>> RunRecord::open(const std::string& directory) {
  std::unique_ptr<RunRecord> out(new RunRecord);
  out->directory_ = directory;
  if (directory.empty()) return out;
  std::error_code error;
  std::filesystem::create_directories(directory, error);
  if (error) return Error{fmt::format("{}: cannot be made a run folder: {}", directory, error.message())};
  const auto open_file = [&](const std::string& name) { return std::fopen((directory + "/" + name).c_str(), "w"); };
  for (const char* table : {"frames", "updates"}) {
    out->tables_[table].file = open_file(std::string(table) + ".csv");
    if (!out->tables_[table].file)
      return Error{fmt::format("{}: cannot write into it: {}", directory, std::strerror(errno))};
  }
  out->tiles_file_ = open_file("tiles.csv");
  out->epochs_file_ = open_file("epochs.csv");
  out->trace_file_ = open_file("trace.json");
  if (!out->tiles_file_ || !out->epochs_file_ || !out->trace_file_)
    return Error{fmt::format("{}: cannot write into it: {}", directory, std::strerror(errno))};
  write_text(out->tiles_file_,
             "frame,tile,lease,sampler,samples,kept,bytes_sampled,bytes_sent,leased_s,sample_begin_s,sample_end_s,"
             "encode_end_s,receive_s,packed_s,x,y,width,height,step\n");
  write_text(out->trace_file_, "[\n");
  return out;
}

RunRecord::~RunRecord() {
  for (auto& [name, table] : tables_)
    if (table.file) std::fclose(table.file);
  if (tiles_file_) std::fclose(tiles_file_);
  if (epochs_file_) std::fclose(epochs_file_);
  if (assignment_file_) std::fclose(assignment_file_);
  if (trace_file_) {
    write_text(trace_file_, "\n]\n");
    std::fclose(trace_file_);
  }
}

Status RunRecord::add_rows(const Process& process, const wire::MetricRows& rows) {
  if (rows.table == "spans") {
    if (rows.values.size() % 4)
      return Error{fmt::format("spans hold {} values, not a multiple of 4", rows.values.size())};
    write_spans(process, rows);
    return ok_status();
  }
  if (rows.table == "frames" || rows.table == "updates") return write_row_table(process.name, rows);
  return Error{fmt::format("metrics table '{}' is unknown", rows.table.substr(0, 32))};
}

Status RunRecord::write_row_table(const std::string& process, const wire::MetricRows& rows) {
  Table& table = tables_[rows.table];
  const size_t width = rows.columns.size();
  if (width == 0 || rows.values.size() % width)
    return Error{
        fmt::format("table {}: {} values do not fill rows of {} columns", rows.table, rows.values.size(), width)};
  if (table.columns.empty()) {
    table.columns = rows.columns;
    std::string header = "viewer";
    for (const auto& c : table.columns) header += "," + c;
    write_text(table.file, header + "\n");
  }
  if (table.columns != rows.columns)
    return Error{fmt::format("table {}: columns differ from those of its first rows", rows.table)};
  if (table.values.size() + rows.values.size() > kMaxRows)
    return Error{fmt::format("table {}: more than {} values", rows.table, kMaxRows)};
  for (size_t i = 0; i < rows.values.size(); i += width) {
    std::string line = process;
    for (size_t c = 0; c < width; ++c) line += "," + shortest(rows.values[i + c]);
    write_text(table.file, line + "\n");
  }
  if (table.file) std::fflush(table.file);
  const auto viewer = std::find(viewers_.begin(), viewers_.end(), process);
  table.viewers.insert(table.viewers.end(), rows.values.size() / width, uint32_t(viewer - viewers_.begin()));
  if (viewer == viewers_.end()) viewers_.push_back(process);
  table.values.insert(table.values.end(), rows.values.begin(), rows.values.end());
  return ok_status();
}

void RunRecord::write_spans(const Process& process, const wire::MetricRows& rows) {
  const auto event = [&](const nlohmann::json& e) {
    write_text(trace_file_, (trace_has_events_ ? ",\n" : "") + e.dump());
    trace_has_events_ = true;
  };
  if (trace_names_.emplace(process.name, 1).second)
    event({{"ph", "M"}, {"name", "process_name"}, {"pid", process.pid}, {"args", {{"name", process.name}}}});
  for (size_t i = 0; i + 3 < rows.values.size(); i += 4) {
    const double name = rows.values[i];
    if (!(name >= 0 && name < double(rows.columns.size()))) continue;
    event({{"ph", "X"},
           {"name", rows.columns[size_t(name)]},
           {"pid", process.pid},
           {"tid", int(rows.values[i + 3])},
           {"ts", std::round(rows.values[i + 1] * 1e6)},
           {"dur", std::round((rows.values[i + 2] - rows.values[i + 1]) * 1e6)}});
  }
}

void RunRecord::add_tile(const std::string& sampler, const wire::TileDone& t) {
  tiles_.push_back(t);
  busy_s_[sampler] += std::max(0.0, t.encode_end_s - t.sample_begin_s);
  if (!tiles_file_) return;
  fmt::memory_buffer line;
  fmt::format_to(std::back_inserter(line),
                 "{},{},{},{},{},{},{},{},{:.6f},{:.6f},{:.6f},{:.6f},{:.6f},{:.6f},{},{},{},{},{}\n", t.frame.value,
                 t.tile, t.lease.value, sampler, t.samples, t.kept, t.bytes_sampled, t.bytes_sent, t.leased_s,
                 t.sample_begin_s, t.sample_end_s, t.encode_end_s, t.receive_s, t.packed_s, t.rect.x, t.rect.y,
                 t.rect.width, t.rect.height, t.step);
  std::fwrite(line.data(), 1, line.size(), tiles_file_);
}

void RunRecord::add_epoch(EpochId epoch, double t_s, const std::map<std::string, double>& parameters,
                          const std::map<std::string, std::string>& texts) {
  if (epochs_++ == 0) {
    std::string header = "epoch,t_s";
    for (const auto& [name, value] : parameters) epoch_columns_.push_back(name), header += "," + name;
    for (const auto& [name, text] : texts) epoch_texts_.push_back(name), header += "," + name;
    write_text(epochs_file_, header + "\n");
  }
  std::string line = fmt::format("{},{:.6f}", epoch.value, t_s);
  for (const auto& name : epoch_columns_) {
    const auto found = parameters.find(name);
    // Exact: the frame can be made again from it.
    line += found == parameters.end() ? "," : fmt::format(",{}", found->second);
  }
  for (const auto& name : epoch_texts_) {
    const auto found = texts.find(name);
    line += found == texts.end() ? "," : "," + csv_quoted(found->second);
  }
  write_text(epochs_file_, line + "\n");
  if (epochs_file_) std::fflush(epochs_file_);
}

void RunRecord::add_assignment(const std::vector<Assignment>& transfers) {
  if (directory_.empty()) return;
  if (!assignment_file_) {
    assignment_file_ = std::fopen((directory_ + "/assignment.csv").c_str(), "w");
    write_text(assignment_file_, "partition,round,data_server,sampler,begin,end,bytes\n");
  }
  for (const auto& t : transfers)
    write_text(assignment_file_, fmt::format("{},{},{},{},{},{},{}\n", t.partition, t.round, csv_quoted(t.data_server),
                                             csv_quoted(t.sampler), t.begin, t.end, t.bytes));
  if (assignment_file_) std::fflush(assignment_file_);
}

std::vector<double> RunRecord::column(const std::string& table, const std::string& name) const {
  std::vector<double> out;
  const auto it = tables_.find(table);
  if (it == tables_.end()) return out;
  const auto& columns = it->second.columns;
  const auto c = std::find(columns.begin(), columns.end(), name);
  if (c == columns.end()) return out;
  for (size_t i = size_t(c - columns.begin()); i < it->second.values.size(); i += columns.size())
    out.push_back(it->second.values[i]);
  return out;
}

std::map<std::string, RunRecord::ViewerFigures> RunRecord::by_viewer() const {
  std::map<std::string, ViewerFigures> out;
  const auto whose = [&](const std::string& table, size_t row) -> ViewerFigures& {
    return out[viewers_[tables_.at(table).viewers[row]]];
  };
  const auto times = column("frames", "t_s"), delays = column("frames", "inter_frame_ms");
  std::map<const ViewerFigures*, double> last_s;
  for (size_t i = 0; i < times.size(); ++i) {
    ViewerFigures& v = whose("frames", i);
    // A viewer that was started again counts its time anew.
    if (const auto last = last_s.find(&v); last != last_s.end() && times[i] > last->second)
      v.duration_s += times[i] - last->second;
    last_s[&v] = times[i];
    ++v.frames;
    if (i < delays.size() && delays[i] > 0) v.inter_frame_ms.push_back(delays[i]);  // its first frame has none
  }
  const auto latencies = column("updates", "latency_ms");
  for (size_t i = 0; i < latencies.size(); ++i) {
    ViewerFigures& v = whose("updates", i);
    ++v.updates;
    v.latency_ms.push_back(latencies[i]);
  }
  return out;
}

nlohmann::ordered_json RunRecord::summary(const std::vector<Process>& processes,
                                          const std::map<std::string, double>& counters) const {
  using nlohmann::ordered_json;
  const auto count_of = [&](const std::string& role) {
    return std::count_if(processes.begin(), processes.end(),
                         [&](const Process& p) { return p.role == role && !p.replaced; });
  };
  const auto fact = [&](const std::string& role, const std::string& key) -> std::string {
    for (const Process& p : processes)
      if (const auto it = p.facts.find(key); p.role == role && !p.replaced && it != p.facts.end()) return it->second;
    return "";
  };
  const auto number = [&](const std::string& role, const std::string& key) {
    const std::string text = fact(role, key);
    return text.empty() ? 0.0 : std::strtod(text.c_str(), nullptr);
  };
  const auto sum_status = [&](const std::string& role, const std::string& key) {
    double sum = 0;
    for (const Process& p : processes)
      if (const auto it = p.values.find(key); (role.empty() || p.role == role) && it != p.values.end())
        sum += it->second;
    return sum;
  };
  // What is held now is held by the living; what was counted adds up over all lives.
  const auto sum_present = [&](const std::string& role, const std::string& key) {
    double sum = 0;
    for (const Process& p : processes)
      if (const auto it = p.values.find(key); p.role == role && !p.replaced && it != p.values.end()) sum += it->second;
    return sum;
  };
  const auto counter = [&](const std::string& key) {
    const auto it = counters.find(key);
    return it == counters.end() ? 0.0 : it->second;
  };

  // Per frame: sampling from the first tile's begin to the last one's end; packing is the sum over its tiles. Coarse frames are a part of
  // their view only, so they would flatter these figures.
  struct FrameTimes {
    double leased = 1e300, begin = 1e300, end = 0, packing_s = 0;
  };
  std::map<uint64_t, FrameTimes> frames;
  double bytes_raw = 0, bytes_sent = 0, samples = 0, kept = 0;
  const bool volume = fact("data", "kind") == "volume";  // then samples are voxels, and kept are pixels that they made
  for (const auto& t : tiles_) {
    if (t.step == 1) {
      auto& f = frames[t.frame.value];
      f.leased = std::min(f.leased, t.leased_s);
      f.begin = std::min(f.begin, t.sample_begin_s);
      f.end = std::max(f.end, t.encode_end_s);
      f.packing_s += t.packed_s - t.receive_s;
    }
    bytes_raw += volume ? double(t.kept) * kRawBytesPerSlicePixel : double(t.samples) * image::kRawBytesPerPixel;
    bytes_sent += double(t.bytes_sent);
    samples += double(t.samples);
    kept += double(t.kept);
  }
  std::vector<double> leased_ms, sampling_ms, packing_ms;
  for (const auto& [id, f] : frames) {
    leased_ms.push_back((f.end - f.leased) * 1e3);
    sampling_ms.push_back((f.end - f.begin) * 1e3);
    packing_ms.push_back(f.packing_s * 1e3);
  }

  const auto times = column("frames", "t_s");
  auto delays = column("frames", "inter_frame_ms");
  std::erase_if(delays, [](double d) { return d <= 0; });  // the first frame of a viewer has none
  // Each viewer by itself: they need not have begun, nor ended, together.
  auto viewers_json = ordered_json::object();
  double span_s = 0, fps = 0, updates_per_s = 0;
  const auto figures = by_viewer();
  const auto hundredths = [](double v) { return std::round(v * 100) / 100; };
  for (const auto& [name, v] : figures) {
    const double seconds = std::max(v.duration_s, 1e-9);
    const double rate = v.duration_s > 0 ? double(v.frames) / seconds : 0;
    const double updates = v.duration_s > 0 ? double(v.updates) / seconds : 0;
    span_s = std::max(span_s, v.duration_s);
    fps += rate / double(figures.size());
    updates_per_s += updates / double(figures.size());
    viewers_json[name] = {{"frames", v.frames},
                          {"updates", v.updates},
                          {"duration_s", std::round(v.duration_s * 1000) / 1000},
                          {"fps", hundredths(rate)},
                          {"updates_per_s", hundredths(updates)},
                          {"inter_frame_delay_ms", to_json(distribution(v.inter_frame_ms))},
                          {"view_update_latency_ms", to_json(distribution(v.latency_ms))}};
  }
  const double viewers = std::max<double>(1, double(count_of("viewer")));
  const double run_s = std::max(span_s, 1e-9);
  double consumed = sum_status("viewer", "points_received") * kRawBytesPerPoint;
  if (volume)
    for (const double pixels : column("updates", "points")) consumed += pixels * kRawBytesPerSlicePixel;
  const double voxels_fetched = sum_status("data", "voxels_sent");

  ordered_json rss = ordered_json::object();
  for (const char* role : {"master", "data", "packer"})
    for (const Process& p : processes)
      if (const auto it = p.values.find("peak_rss_mb"); p.role == role && it != p.values.end())
        rss[role] = std::round(it->second * 10) / 10;
  for (const char* role : {"sampler", "viewer"}) {
    rss[role] = ordered_json::array();
    for (const Process& p : processes)
      if (const auto it = p.values.find("peak_rss_mb"); p.role == role && it != p.values.end())
        rss[role].push_back(std::round(it->second * 10) / 10);
  }
  const double points = sum_present("packer", "points");
  return {
      {"schema", 1},
      {"scene", fact("data", "scene")},
      {"kind", fact("data", "kind")},
      {"primitives", uint64_t(number("data", volume ? "voxels" : "triangles"))},
      {"samplers", count_of("sampler")},
      {"viewers", count_of("viewer")},
      {"coupling", fact("viewer", "coupling")},
      {"buffers", uint64_t(number("viewer", "buffers"))},
      {"renderer", fact("viewer", "renderer")},
      {"splat", fact("viewer", "splat")},
      {"finish", fact("viewer", "finish")},
      {"shading", fact("viewer", "shading")},
      {"size", {uint64_t(number("viewer", "width")), uint64_t(number("viewer", "height"))}},
      {"sampling_size", {uint64_t(number("viewer", "sampling_width")), uint64_t(number("viewer", "sampling_height"))}},
      {"sampling", fact("viewer", "sampling")},
      {"epochs", epochs_},
      {"frames", times.size()},
      {"updates", column("updates", "latency_ms").size()},
      {"duration_s", std::round(span_s * 1000) / 1000},
      {"fps", hundredths(fps)},
      {"updates_per_s", hundredths(updates_per_s)},
      {"by_viewer", viewers_json},
      {"frames_sampled", uint64_t(counter("frames_completed"))},
      {"inter_frame_delay_ms", to_json(distribution(delays))},
      {"view_construction_ms", to_json(distribution(column("frames", "construction_ms")))},
      {"view_update_latency_ms", to_json(distribution(column("updates", "latency_ms")))},
      {"start_up_latency_ms", to_json(distribution(column("updates", "start_up_ms")))},
      {"sampling_ms", to_json(distribution(sampling_ms))},
      {"lease_to_sampled_ms", to_json(distribution(leased_ms))},
      {"packing_ms", to_json(distribution(packing_ms))},
      {"samplers_busy", busy_spread(busy_s_)},
      {"data_generating_rate_mb_s", bytes_raw / 1e6 / run_s},
      {"data_transfer_rate_mb_s", bytes_sent / 1e6 / run_s},
      {"data_consuming_rate_mb_s", consumed / 1e6 / viewers / run_s},
      {"bytes_raw", uint64_t(bytes_raw)},
      {"bytes_sent", uint64_t(bytes_sent)},
      {"compression_ratio", bytes_sent > 0 ? bytes_raw / bytes_sent : 0.0},
      {"redundancy_eliminated", samples > 0 && !volume ? 1 - kept / samples : 0.0},
      {"points_cached", uint64_t(points)},
      {"bytes_per_cached_point", points > 0 ? sum_present("packer", "model_bytes") / points : 0.0},
      {"points_drawn", to_json(distribution(column("frames", "points_drawn")))},
      {"update_age_ms", to_json(distribution(column("frames", "update_age_ms")))},
      {"voxels_fetched", uint64_t(voxels_fetched)},
      {"bytes_per_voxel", voxels_fetched > 0 ? sum_status("data", "bytes_sent") / voxels_fetched : 0.0},
      {"partitions", uint64_t(counter("partitions"))},
      {"first_points_s", sum_present("viewer", "first_points_s") / viewers},
      {"tiles_released", uint64_t(counter("tiles_released"))},
      {"leases_backup", uint64_t(counter("leases_backup"))},
      {"quality", nullptr},
      {"peak_rss_mb", rss},
      {"errors",
       {{"messages_rejected", uint64_t(sum_status("", "messages_rejected"))},
        {"gaps_resynced", uint64_t(sum_status("viewer", "gaps_resynced"))},
        {"leases_expired", uint64_t(counter("leases_expired"))}}}};
}

Status RunRecord::finish(const std::vector<Process>& processes, const std::map<std::string, double>& counters) {
  if (directory_.empty()) return ok_status();
  if (tiles_file_) std::fflush(tiles_file_);
  const std::string path = directory_ + "/summary.json";
  std::ofstream out(path + ".part");
  out << summary(processes, counters).dump(2) << "\n";
  out.close();
  std::error_code error;
  if (out) std::filesystem::rename(path + ".part", path, error);
  if (!out || error) return Error{fmt::format("{}: cannot be written", path)};
  return ok_status();
}

}  // namespace telesplat::metrics
