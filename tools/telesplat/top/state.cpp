#include "tools/telesplat/top/state.h"

#include <algorithm>
#include <limits>

#include "tools/telesplat/control/json_fields.h"
#include "tools/telesplat/control/status_text.h"

namespace telesplat::launcher {
namespace {

using Json = nlohmann::ordered_json;

constexpr size_t kMostProcesses = 4096;

// Whoever named it does not move the cursor.
std::string clean(std::string text) {
  const auto byte = [&](size_t i) { return static_cast<unsigned char>(text[i]); };
  for (size_t i = 0; i < text.size(); ++i) {
    // U+0080 to U+009F are control characters, too.
    const bool wide = byte(i) == 0xc2 && i + 1 < text.size() && byte(i + 1) >= 0x80 && byte(i + 1) < 0xa0;
    if (wide) text.erase(i + 1, 1);
    if (wide || byte(i) < 0x20 || byte(i) == 0x7f) text[i] = '?';
  }
  return text;
}
std::string clean_text(const Json& object, const char* key) { return clean(text(object, key)); }

std::map<std::string, double> numbers(const Json& object, const char* key) {
  std::map<std::string, double> out;
  if (const auto* group = field(object, key); group && group->is_object())
    for (const auto& [name, value] : group->items())
      if (value.is_number()) out[clean(name)] = value.get<double>();
  return out;
}

template <class V>
std::optional<V> find(const std::map<std::string, V>& map, const std::string& key) {
  const auto found = map.find(key);
  return found == map.end() ? std::nullopt : std::optional(found->second);
}

TopProcess read_process(const Json& p) {
  TopProcess out{.role = clean_text(p, "role"),
                 .name = clean_text(p, "name"),
                 .host = {},
                 .alive = flag(p, "alive"),
                 .silent_s = number(p, "silent_s").value_or(0),
                 .leases = number(p, "leases"),
                 .facts = {},
                 .values = numbers(p, "values"),
                 .rates = numbers(p, "rates")};
  if (const auto* facts = field(p, "facts"); facts && facts->is_object())
    for (const auto& [name, value] : facts->items())
      if (value.is_string()) out.facts[clean(name)] = clean(value.get<std::string>());
  out.host = out.fact("host");
  return out;
}

void push(std::deque<double>& values, std::optional<double> value) {
  values.push_back(value.value_or(std::numeric_limits<double>::quiet_NaN()));
  if (values.size() > TopHistory::kSeconds) values.pop_front();
}

}  // namespace

std::optional<double> TopProcess::value(const std::string& key) const { return find(values, key); }
std::optional<double> TopProcess::rate(const std::string& key) const { return find(rates, key); }
std::string TopProcess::fact(const std::string& key) const { return find(facts, key).value_or(""); }

std::vector<const TopProcess*> TopState::alive(const std::string& role) const {
  std::vector<const TopProcess*> out;
  for (const TopProcess& p : processes)
    if (p.alive && p.role == role) out.push_back(&p);
  return out;
}

TopState read_top_state(const Json& status) {
  TopState out;
  if (const auto* session = field(status, "session")) {
    out.scene = clean_text(*session, "scene");
    out.kind = clean_text(*session, "kind");
    out.started_by = clean_text(*session, "started_by");
    out.started_at_s = read_utc(text(*session, "started_at"));
  }
  out.epoch = number(status, "epoch").value_or(0);
  out.frames_completed = number(status, "frames_completed").value_or(0);
  out.frames_in_flight = number(status, "frames_in_flight").value_or(0);
  out.leases_expired = number(status, "leases_expired").value_or(0);
  if (const auto* processes = field(status, "processes"); processes && processes->is_array())
    for (const Json& p : *processes)
      if (p.is_object() && out.processes.size() < kMostProcesses) out.processes.push_back(read_process(p));
  std::stable_sort(out.processes.begin(), out.processes.end(),
                   [](const TopProcess& a, const TopProcess& b) { return a.name < b.name; });
  return out;
}

void TopHistory::add(const TopState& state, double now_s) {
  std::map<std::string, Viewer> here;
  for (const TopProcess* p : state.alive("viewer")) {
    Viewer& v = here[p->name] = std::move(viewers_[p->name]);
    push(v.fps, p->rate("frames"));
    push(v.latency_ms, p->value("update_latency_ms"));
  }
  viewers_ = std::move(here);

  std::map<std::string, double> counts{{"leases expired", state.leases_expired}};
  for (const TopProcess& p : state.processes) {
    counts["messages rejected"] += p.value("messages_rejected").value_or(0);
    counts["gaps"] += p.value("gaps_resynced").value_or(0);
  }
  for (const auto& [what, count] : counts) {
    Counted& c = errors_[what];
    if (begun_ && count > c.count) c.rose_s = now_s;
    c.count = count;
  }
  begun_ = true;
}

const TopHistory::Viewer* TopHistory::viewer(const std::string& name) const {
  const auto found = viewers_.find(name);
  return found == viewers_.end() ? nullptr : &found->second;
}

std::map<std::string, TopHistory::Error> TopHistory::errors(double now_s) const {
  std::map<std::string, Error> out;
  for (const auto& [what, c] : errors_)
    if (c.count > 0) out[what] = {c.count, now_s - c.rose_s < double(kSeconds)};
  return out;
}

}  // namespace telesplat::launcher
