// A session as `telesplat top` shows it: what the master's status says, and what it said in the last minute.
#pragma once

#include <deque>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

namespace telesplat::launcher {

struct TopProcess {
  std::string role, name, host;
  bool alive = false;
  double silent_s = 0;
  std::optional<double> leases;  ///< of samplers: tiles that they hold, waiting ones included
  std::map<std::string, std::string> facts;
  std::map<std::string, double> values, rates;  ///< docs/metrics.md, "While it runs"

  std::optional<double> value(const std::string& key) const;
  std::optional<double> rate(const std::string& key) const;  ///< a second
  std::string fact(const std::string& key) const;
};

/// Of a master's answer to "status". Texts are fit for a terminal: they have no control characters.
struct TopState {
  std::string scene, kind, started_by;
  double started_at_s = 0;  ///< wall clock; 0: not told
  double epoch = 0, frames_completed = 0, frames_in_flight = 0, leases_expired = 0;
  std::vector<TopProcess> processes;  ///< by name

  std::vector<const TopProcess*> alive(const std::string& role) const;
};
TopState read_top_state(const nlohmann::ordered_json& status);

/// The last minute, a value a second.
class TopHistory {
 public:
  static constexpr size_t kSeconds = 60;

  /// To be called once a second.
  void add(const TopState& state, double now_s);

  /// Of a viewer, oldest first; NaN: nothing was told in that second.
  struct Viewer {
    std::deque<double> fps, latency_ms;
  };
  const Viewer* viewer(const std::string& name) const;

  /// Errors by what they are ("leases expired"), since the session began; and whether there were more in the last
  /// minute.
  struct Error {
    double count = 0;
    bool recent = false;
  };
  std::map<std::string, Error> errors(double now_s) const;

 private:
  struct Counted {
    double count = 0, rose_s = -1e9;
  };
  std::map<std::string, Viewer> viewers_;
  std::map<std::string, Counted> errors_;
  bool begun_ = false;
};

}  // namespace telesplat::launcher
