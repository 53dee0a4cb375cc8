// Which samplers deliver: what others wait for is leased to these alone.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace telesplat::master {

/// All are served alike if the trusted ones have delivered nothing for this long: they may be dead.
inline constexpr double kTrusted_s = 2.0;
/// A sampler that holds work and delivers nothing for this long is told of.
inline constexpr double kTold_s = 1.0;

/// A sampler has failed that kept others waiting and has delivered nothing since; trusted is who delivered and has not
/// failed. A new one is neither.
class Trust {
 public:
  /// What came is of a lease that it held.
  void delivered(const std::string& sampler, double now_s);
  /// Its lease ran out, another was faster with what it kept for too long, or what it delivered cannot be used.
  void failed(const std::string& sampler, double now_s);
  void leave(const std::string& sampler);

  bool has(const std::string& sampler) const;
  bool has_failed(const std::string& sampler) const;
  /// A trusted one delivered lately.
  bool lately(double now_s) const { return trusted_ > 0 && now_s - delivered_s_ < kTrusted_s; }
  /// Seconds since it failed, of one that news() told of; else nullopt.
  std::optional<double> stuck_s(const std::string& sampler, double now_s) const;

  /// How many samplers news() told that deliver nothing.
  size_t stuck() const { return stuck_; }

  struct News {
    std::string sampler;
    bool delivers;  ///< again
  };
  /// Samplers that hold work and have delivered nothing for kTold_s, and those of these that deliver again: each once.
  std::vector<News> news(double now_s, const std::function<bool(const std::string&)>& holds_work);

 private:
  struct State {
    bool trusted = false;  // else it has failed
    double since_s = 0;
    bool told = false;
  };
  std::map<std::string, State> samplers_;
  size_t trusted_ = 0, stuck_ = 0;
  double delivered_s_ = 0;  // by any
};

}  // namespace telesplat::master
