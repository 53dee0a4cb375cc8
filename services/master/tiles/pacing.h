// What paces a session's views: how short the queues before viewers' links are kept, what sampling costs, and how many
// rays of a view may make finer what is shown already. No sockets, no clocks.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/wire/messages.h"
#include "services/master/views.h"

namespace telesplat::master {

/// Says when a view may begin, when another of its tiles may be sampled, and how many rays an update may have, by what
/// the packer says of each link.
class LinkGate {
 public:
  static constexpr double kQueue_s = 0.05;  ///< what may wait before a link, beside what is under way on it
  /// May wait in any case: less than this is late for other reasons.
  static constexpr double kLeastQueue = 32 << 10;
  /// May be under way while nothing is known of a rate: for views, and for what is beyond them.
  static constexpr double kUnknown = 256 << 10, kUnknownExtra = 96 << 10;
  static constexpr double kUpdate_s = 0.1;    ///< what an update should take a link
  static constexpr double kSpeedShare = 0.9;  ///< of a measured rate that is planned with
  static constexpr double kSilent_s = 2;      ///< a viewer that said nothing for so long while bytes wait does not read
  static constexpr uint64_t kLeastRays = 1024;

  /// Of each viewer, bytes a second that are wished at most; 0: no wish.
  void set_most(double bytes_s) { most_bytes_s_ = bytes_s; }

  void report(const wire::LinkReport& link, double now_s);
  enum class Rays {
    kPlanned,  ///< those of a plan, most of which find what is known
    kAll       ///< of a view that is sampled whole
  };
  /// A part of a frame went to all viewers. rays: that were cast for it; 0: not known.
  void published(uint64_t bytes, uint64_t rays, double now_s, Rays which = Rays::kPlanned);
  void forget(InstanceId viewer) { links_.erase(viewer); }
  /// Another packer: nothing is under way from it.
  void clear() { links_.clear(); }

  /// More may be sent to this viewer, now. A viewer of which nothing is known is always ready.
  bool open(InstanceId viewer, double now_s) const;
  /// Nothing waits before any link, those of viewers that do not read left out: there is room for what nobody asked
  /// for.
  bool idle(double now_s) const;
  /// Rays that the link carries in an update's time, once coded; 0: no limit is known.
  uint64_t update_rays(InstanceId viewer) const;
  /// How long the link would need for a view of so many rays that is sampled whole; nullopt: it is not known.
  std::optional<double> takes_s(InstanceId viewer, double rays) const;
  /// There is no viewer that tells of its link, or of one the rate is known.
  bool known() const;
  /// The least of all viewers that read.
  uint64_t least_update_rays(double now_s) const;
  /// "link_mbit", "backlog_bytes", "rtt_ms", as far as they are known.
  std::map<std::string, double> figures(InstanceId viewer) const;

 private:
  struct Link {
    wire::LinkReport told;
    double told_s = 0;
    double since_bytes = 0;                 // published since
    double wished_bytes = 0, wished_s = 0;  // what a link of the wished rate would still hold, and when
    double backlog() const { return double(told.backlog_bytes) + since_bytes; }
  };
  double rate(const Link& link) const;
  double wished_backlog(const Link& link, double now_s) const;
  bool reads(const Link& link, double now_s) const;
  bool has_room(const Link& link, bool extra, double now_s) const;

  double most_bytes_s_ = 0;
  std::map<InstanceId, Link> links_;
  RunningMean bytes_a_ray_{0.05}, bytes_of_all_{0.05};  // a ray
};

/// What sampling costs whom: learnt from finished tiles, used to size leases.
class SamplingCosts {
 public:
  /// `sampler` takes leases.
  void join(const std::string& sampler);
  void leave(const std::string& sampler);
  size_t samplers() const { return samplers_.size(); }

  /// A tile of `pixels` pixels took `sampler` so long. Ignored: samplers that left, times that are not above 0.
  void learn(const std::string& sampler, double seconds, double pixels);
  /// Seconds a pixel: mean of the sampler's last ten tiles or so, weighted by pixels; while it has none that of all; 0
  /// if nothing is known.
  double pixel_s(const std::string& sampler) const;
  /// The sampler has finished tiles.
  bool knows(const std::string& sampler) const;

 private:
  struct Mean {
    double seconds = 0, pixels = 0;
    void add(double s, double n);
  };
  std::map<std::string, Mean> samplers_;
  Mean all_;
};

/// A head that comes nearer, or a viewer that asks for finer views, makes rays useful in most pixels at once. All of
/// them in one view would keep the next views waiting; so a view gets as many as fit into its time, the middle first,
/// and the following ones get the rest. The number follows how long views take.
class RefiningRays {
 public:
  /// From a view's plan to its last tile.
  static constexpr double kTarget_s = 0.04;
  /// Times as many rays at edges as elsewhere (PlanRequest::most_rays).
  static constexpr double kEdges = 4;
  static constexpr double kLeast = 4096, kFirst = 16384, kMost = 1 << 24;

  /// Of all samplers together; at least one.
  uint64_t most(size_t samplers) const;

  /// A view is complete. refining: its rays that were such, of those at edges a kEdges-th; put_off: those that were
  /// left to later views.
  void learn(double took_s, double refining, double put_off, size_t samplers);

 private:
  double each_ = kFirst;  // sampler
};

// Which samplers deliver: what others wait for is leased to these alone.

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
