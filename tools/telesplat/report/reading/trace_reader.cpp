#include "tools/telesplat/report/reading/trace_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

#include "common/core/utf8.h"

namespace telesplat::launcher {
namespace {

constexpr size_t kLongestName = 200;
// Of what a trace may have many of without being large. More are told under one name, or left out.
constexpr size_t kMostNames = 10'000, kMostLanes = 10'000, kMostOpen = 1'000'000;
constexpr const char* kOthers = "others";
constexpr double kShorter = 0.9, kShortest_us = 1;  // of windows

// What was told of one event.
struct Told {
  std::string phase, name, category, id, args_name;
  std::optional<double> ts, duration, pid, tid, frame, tile, request;
};

/// Takes JSON apart as it comes; only events are kept.
class Reader : public nlohmann::json_sax<nlohmann::json> {
 public:
  Reader(Trace& trace, size_t most) : trace_(trace), most_(most) {}

  bool null() override { return true; }
  bool boolean(bool) override { return true; }
  bool number_integer(number_integer_t v) override { return number(double(v)); }
  bool number_unsigned(number_unsigned_t v) override { return number(double(v)); }
  bool number_float(number_float_t v, const string_t&) override { return number(v); }
  bool binary(binary_t&) override { return true; }
  bool string(string_t& v) override {
    if (inside_ > 0) {
      if (in_args() && key_ == "name") now_.args_name = v;
      return true;
    }
    if (key_ == "ph") now_.phase = v;
    if (key_ == "name") now_.name = v;
    if (key_ == "cat") now_.category = v;
    if (key_ == "id") now_.id = v;
    return true;
  }
  bool key(string_t& v) override {
    key_ = v;
    return true;
  }
  bool start_object(std::size_t) override {
    if (in_event_) {
      if (++inside_ == 1) args_ = key_ == "args";
    } else if (in_list_) {
      in_event_ = true;
      now_ = {};
    }
    return true;
  }
  bool end_object() override {
    if (in_event_ && inside_ == 0) {
      in_event_ = false;
      take();
    } else if (in_event_) {
      --inside_;
    }
    return true;
  }
  bool start_array(std::size_t) override {
    if (!in_event_)
      in_list_ = true;
    else if (++inside_ == 1)
      args_ = false;
    return true;
  }
  bool end_array() override {
    if (in_event_) --inside_;
    return true;
  }
  bool parse_error(std::size_t, const std::string&, const nlohmann::detail::exception&) override {
    trace_.whole = false;
    return false;
  }

  /// Names that came behind their events are put in; spans without an end are left out.
  void finish() {
    for (auto& [key, lane] : lane_of_)
      if (auto& l = trace_.lanes[lane]; true) {
        if (const auto p = process_names_.find(std::get<0>(key)); p != process_names_.end()) l.process = p->second;
        if (const auto t = thread_names_.find({std::get<0>(key), l.tid}); t != thread_names_.end() && !l.async)
          l.name = t->second;
      }
    for (const auto& [key, spans] : open_) trace_.open += spans.size();
    std::stable_sort(trace_.events.begin(), trace_.events.end(),
                     [](const TraceEvent& a, const TraceEvent& b) { return a.begin_us < b.begin_us; });
  }

 private:
  using LaneKey = std::tuple<int64_t, int64_t, std::string>;  // pid, tid, category of async spans

  bool in_args() const { return inside_ == 1 && args_; }

  bool number(double v) {
    if (in_args()) {
      if (key_ == "frame") now_.frame = v;
      if (key_ == "tile") now_.tile = v;
      if (key_ == "request") now_.request = v;
      return true;
    }
    if (inside_ > 0) return true;
    if (key_ == "ts") now_.ts = v;
    if (key_ == "dur") now_.duration = v;
    if (key_ == "pid") now_.pid = v;
    if (key_ == "tid") now_.tid = v;
    if (key_ == "id") now_.id = fmt::format("{}", v);
    return true;
  }

  static std::string short_text(const std::string& text) { return to_utf8(text.substr(0, kLongestName)); }
  static int64_t number_of(const std::optional<double>& v) { return v && std::abs(*v) < 9e15 ? int64_t(*v) : 0; }
  static int64_t whole(const std::optional<double>& v) { return v && *v >= 0 && *v < 9e15 ? int64_t(*v) : -1; }

  uint32_t name(const std::string& text) {
    std::string own = short_text(text);
    if (name_of_.size() >= kMostNames && !name_of_.contains(own)) own = kOthers;
    const auto [at, fresh] = name_of_.try_emplace(own, uint32_t(trace_.names.size()));
    if (fresh) trace_.names.push_back(own);
    return at->second;
  }
  uint32_t lane(bool async) {
    const int64_t pid = number_of(now_.pid), tid = async ? 0 : number_of(now_.tid);
    const std::string category = async ? short_text(now_.category) : std::string();
    LaneKey key{pid, tid, async ? "b" + category : ""};
    TraceLane own{fmt::format("pid {}", pid), category, tid, async};
    if (lane_of_.size() >= kMostLanes && !lane_of_.contains(key))
      key = {0, 0, kOthers}, own = {kOthers, kOthers, 0, true};
    const auto [at, fresh] = lane_of_.try_emplace(key, uint32_t(trace_.lanes.size()));
    if (fresh) trace_.lanes.push_back(std::move(own));
    return at->second;
  }

  void take() {
    if (now_.phase == "M") return take_name();
    if (now_.phase == "X" && now_.ts && now_.duration) return add(event(false), *now_.ts, *now_.duration);
    if (now_.phase == "b" && now_.ts) {
      if (open_spans_ >= kMostOpen) return void(++trace_.left_out);
      open_[span_key()].push_back({event(true), *now_.ts});
      ++open_spans_;
    }
    if (now_.phase == "e" && now_.ts) {
      const auto found = open_.find(span_key());
      if (found == open_.end() || found->second.empty()) return;
      const auto [begun, ts] = found->second.back();
      found->second.pop_back();
      --open_spans_;
      if (found->second.empty()) open_.erase(found);
      TraceEvent whole_span = begun;
      // Ends may tell what was not known at the beginning.
      for (auto [own, told] : {std::pair{&whole_span.frame, &now_.frame},
                               {&whole_span.tile, &now_.tile},
                               {&whole_span.request, &now_.request}})
        if (*own < 0) *own = whole(*told);
      add(whole_span, ts, *now_.ts - ts);
    }
  }

  void take_name() {
    const int64_t pid = number_of(now_.pid);
    const auto keep = [&](auto& names, const auto& key) {
      if (names.size() < kMostLanes || names.contains(key)) names[key] = short_text(now_.args_name);
    };
    if (now_.name == "process_name") keep(process_names_, pid);
    if (now_.name == "thread_name") keep(thread_names_, std::pair(pid, number_of(now_.tid)));
  }

  TraceEvent event(bool async) {
    TraceEvent e;
    e.lane = lane(async), e.name = name(now_.name);
    e.frame = whole(now_.frame), e.tile = whole(now_.tile), e.request = whole(now_.request);
    return e;
  }
  std::string span_key() const {
    return fmt::format("{}/{}/{}/{}", now_.pid.value_or(0), short_text(now_.category), short_text(now_.id),
                       short_text(now_.name));
  }

  void add(TraceEvent e, double begin_us, double duration_us) {
    const bool sane = std::isfinite(begin_us) && std::abs(begin_us) < 1e15 && duration_us >= 0 && duration_us < 1e15;
    if (!sane || trace_.events.size() >= most_) {
      ++trace_.left_out;
      return;
    }
    e.begin_us = begin_us, e.duration_us = duration_us;
    trace_.events.push_back(e);
  }

  Trace& trace_;
  const size_t most_;
  std::string key_;
  Told now_;
  bool in_list_ = false, in_event_ = false;
  bool args_ = false;  // what is open at depth 1 in the event is its args
  int inside_ = 0;     // objects and lists open within the event
  std::map<std::string, uint32_t> name_of_;
  std::map<LaneKey, uint32_t> lane_of_;
  std::map<int64_t, std::string> process_names_;
  std::map<std::pair<int64_t, int64_t>, std::string> thread_names_;
  std::map<std::string, std::vector<std::pair<TraceEvent, double>>> open_;
  size_t open_spans_ = 0;
};

}  // namespace

Trace read_trace(std::istream& in, size_t most_events) {
  Trace out;
  Reader reader(out, most_events);
  if (!nlohmann::json::sax_parse(in, &reader)) out.whole = false;
  reader.finish();
  return out;
}

TraceWindows choose_windows(const std::vector<TraceEvent>& events, double begin_us, double end_us, size_t most,
                            size_t windows) {
  TraceWindows out;
  if (events.size() <= most || windows == 0 || !(end_us > begin_us)) {
    const size_t n = std::min(events.size(), most);
    for (size_t i = 0; i < n; ++i) out.events.push_back(i);
    out.all = n == events.size();
    if (n > 0) out.windows_us.emplace_back(events.front().begin_us, events[n - 1].begin_us + events[n - 1].duration_us);
    return out;
  }
  out.all = false;
  const size_t share = std::max<size_t>(1, most / windows);
  const double pitch = (end_us - begin_us) / double(windows);
  std::vector<bool> taken(events.size(), false);
  for (size_t k = 0; k < windows; ++k) {
    const double middle = begin_us + (double(k) + 0.5) * pitch;
    // Shorter and shorter until it fits.
    double length = pitch / kShorter;
    std::vector<size_t> inside;
    for (size_t i = 0; i < events.size() && events[i].begin_us < middle + pitch / 2; ++i)
      if (events[i].begin_us + events[i].duration_us > middle - pitch / 2) inside.push_back(i);
    do {
      length *= kShorter;
      std::erase_if(inside, [&](size_t i) {
        return events[i].begin_us >= middle + length / 2 ||
               events[i].begin_us + events[i].duration_us <= middle - length / 2;
      });
    } while (inside.size() > share && length > kShortest_us);
    if (inside.size() > share) inside.resize(share);
    out.windows_us.emplace_back(middle - length / 2, middle + length / 2);
    for (const size_t i : inside) taken[i] = true;
  }
  for (size_t i = 0; i < events.size(); ++i)
    if (taken[i]) out.events.push_back(i);
  return out;
}

}  // namespace telesplat::launcher
