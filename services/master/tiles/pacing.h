// Paces a session's views: keeps queues before viewers' links short, learns the cost of sampling, limits the rays of a
// view that refine what is shown already, and finds samplers that do not deliver. No sockets, no clocks.
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

/// Decides when a view may begin, when another of its tiles may be sampled, and how many rays an update may have, from
/// the packer's reports about each link.
class LinkGate {
 public:
  static constexpr double kQueue_s = 0.05;  ///< data that may wait before a link, as time on it, beside data under way
  /// Bytes that may always wait: if fewer wait, data is late for other reasons.
  static constexpr double kLeastQueue = 32 << 10;
  /// Bytes that may be under way while a link's rate is unknown: for views, and for extra frames.
  static constexpr double kUnknown = 256 << 10, kUnknownExtra = 96 << 10;
  static constexpr double kUpdate_s = 0.1;    ///< time that an update should take on a link
  static constexpr double kSpeedShare = 0.9;  ///< share of a measured rate that plans count on
  static constexpr double kSilent_s = 2;      ///< a viewer that is silent for this time while bytes wait does not read
  static constexpr uint64_t kLeastRays = 1024;

  /// Sets the highest rate that is wished for each viewer, bytes a second; 0: no wish.
  void set_most(double bytes_s) { most_bytes_s_ = bytes_s; }

  void report(const wire::LinkReport& link, double now_s);
  enum class Rays {
    kPlanned,  ///< rays of a plan; most of them hit known surfaces
    kAll       ///< rays of a view that is sampled whole
  };
  /// A part of a frame went to all viewers. rays: number cast for it; 0: not known.
  void published(uint64_t bytes, uint64_t rays, double now_s, Rays which = Rays::kPlanned);
  void forget(InstanceId viewer) { links_.erase(viewer); }
  /// Forgets all links: another packer leads, and nothing is under way from it.
  void clear() { links_.clear(); }

  /// True if more may be sent to this viewer now. A viewer without reports is always ready.
  bool open(InstanceId viewer, double now_s) const;
  /// True if nothing waits before any link, except links of viewers that do not read: there is room for extra frames.
  bool idle(double now_s) const;
  /// Coded rays that the link carries in kUpdate_s; 0: no limit is known.
  uint64_t update_rays(InstanceId viewer) const;
  /// Seconds that the link would need for a view of `rays` rays that is sampled whole; nullopt: not known.
  std::optional<double> takes_s(InstanceId viewer, double rays) const;
  /// True if there are no reports about links, or the rate of a link is known.
  bool known() const;
  /// The least update_rays() of all viewers that read.
  uint64_t least_update_rays(double now_s) const;
  /// "link_mbit", "backlog_bytes", "rtt_ms", as far as they are known.
  std::map<std::string, double> figures(InstanceId viewer) const;

 private:
  struct Link {
    wire::LinkReport told;
    double told_s = 0;
    double since_bytes = 0;                 // bytes published since the report
    double wished_bytes = 0, wished_s = 0;  // bytes that a link of the wished rate held at wished_s
    double backlog() const { return double(told.backlog_bytes) + since_bytes; }
  };
  double rate(const Link& link) const;
  double wished_backlog(const Link& link, double now_s) const;
  bool reads(const Link& link, double now_s) const;
  bool has_room(const Link& link, bool extra, double now_s) const;

  double most_bytes_s_ = 0;
  std::map<InstanceId, Link> links_;
  RunningMean bytes_a_ray_{0.05}, bytes_of_all_{0.05};  // per ray: of plans, of views sampled whole
};

/// The cost of sampling for each sampler: learnt from finished tiles, used to size leases.
class SamplingCosts {
 public:
  /// `sampler` takes leases.
  void join(const std::string& sampler);
  void leave(const std::string& sampler);
  size_t samplers() const { return samplers_.size(); }

  /// Learns from a tile that took `sampler` this time. Ignores samplers that left, and times that are not above 0.
  void learn(const std::string& sampler, double seconds, double pixels);
  /// Seconds a pixel: mean of the sampler's last ten tiles or so, weighted by pixels; while it has no tile, the mean of
  /// all; 0 if nothing is known.
  double pixel_s(const std::string& sampler) const;
  /// True if the sampler has finished a tile.
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
  /// Wished time from a view's plan to its last tile.
  static constexpr double kTarget_s = 0.04;
  /// Edges may have this many times as many rays as other places (PlanRequest::most_rays).
  static constexpr double kEdges = 4;
  static constexpr double kLeast = 4096, kFirst = 16384, kMost = 1 << 24;

  /// Returns the refining rays that a view may have if all samplers work on it.
  uint64_t most(size_t samplers) const;

  /// A view is complete. took_s: from its plan to its last tile; refining: its refining rays, those at edges divided by
  /// kEdges; put_off: rays that were left to later views.
  void learn(double took_s, double refining, double put_off, size_t samplers);

 private:
  double each_ = kFirst;  // refining rays for each sampler
};

// Trust in samplers: tiles that others wait for are leased only to samplers that deliver.

/// All are served alike if the trusted ones have delivered nothing for this long: they may be dead.
inline constexpr double kTrusted_s = 2.0;
/// A sampler that holds work and delivers nothing for this long is reported by news().
inline constexpr double kTold_s = 1.0;

/// A sampler that kept others waiting has failed, until it delivers again. A sampler that delivered and has not failed
/// since is trusted. A new one is neither.
class Trust {
 public:
  /// The sampler delivered a tile of a lease that it held.
  void delivered(const std::string& sampler, double now_s);
  /// The sampler's lease ran out, another was faster with a tile that it kept too long, or its tile cannot be used.
  void failed(const std::string& sampler, double now_s);
  void leave(const std::string& sampler);

  bool has(const std::string& sampler) const;
  bool has_failed(const std::string& sampler) const;
  /// True if there are trusted samplers, and one delivered within kTrusted_s.
  bool lately(double now_s) const { return trusted_ > 0 && now_s - delivered_s_ < kTrusted_s; }
  /// Seconds since the sampler failed, if news() reported it; else nullopt.
  std::optional<double> stuck_s(const std::string& sampler, double now_s) const;

  /// Number of samplers that news() reported and that still deliver nothing.
  size_t stuck() const { return stuck_; }

  struct News {
    std::string sampler;
    bool delivers;  ///< it delivers again; false: it delivers nothing
  };
  /// Reports samplers that hold work and have delivered nothing for kTold_s, and those that deliver again: each once.
  std::vector<News> news(double now_s, const std::function<bool(const std::string&)>& holds_work);

 private:
  struct State {
    bool trusted = false;  // else it has failed
    double since_s = 0;
    bool told = false;
  };
  std::map<std::string, State> samplers_;
  size_t trusted_ = 0, stuck_ = 0;
  double delivered_s_ = 0;  // when a sampler last delivered
};

}  // namespace telesplat::master
