// Keeps queues before viewers' links short: says when a view may begin, when another of its tiles may be sampled, and
// how many rays an update may have, by what the packer says of each link. No sockets, no clocks.
#pragma once

#include <cstdint>
#include <map>
#include <optional>

#include "common/wire/messages.h"
#include "services/master/views.h"

namespace telesplat::master {

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

}  // namespace telesplat::master
