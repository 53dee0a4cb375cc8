// The packer process (T4.3): takes the samplers' messages and sends viewers the points that they lack.
#pragma once

#include <memory>
#include <optional>

#include "common/net/turns.h"
#include "common/wire/tile_messages.h"
#include "services/packer/packer_options.h"

namespace telesplat::packer {

class PackerService : public net::Turns {
 public:
  /// Binds its sockets. Error: a socket cannot be bound, or the folder for recordings cannot be written. Context and
  /// options must outlive the service.
  static Result<std::unique_ptr<PackerService>> open(net::Context& context, const PackerOptions& options);
  virtual int exit_code() const = 0;
};

/// Serves until told to stop. Exit code 0, or 2 if it cannot bind.
Result<int> run(const PackerOptions& options);

/// Decides when the packer plans rays beyond views: while no view is under way. No sockets, no clocks.
class SpareTime {
 public:
  /// Deferrable work waits while a view is under way, but at most this long: with many viewers one always is.
  static constexpr double kLongestHurry_s = 0.25;
  /// Where views come as fast as they are answered, planning beyond them takes at most 1 / (1 + kPause) of the time.
  static constexpr double kPause = 3;

  /// True if deferrable work may begin. hurried: a view is under way.
  bool begins(double now_s, bool hurried);

  /// Keeps a request for rays beyond a view. The master waits for the newest answer alone: this one replaces the older.
  void keep(const wire::PlanRequest& extra) { question_ = extra; }
  /// A viewer's next view is planned: its waiting request is about this view from now on.
  void follow(const wire::PlanRequest& view);
  /// Returns the request to work on. Null: none, or it pauses (kPause), which a resting head's does not.
  const wire::PlanRequest* question(double now_s) const;
  /// Notes that a piece of the work for question() took from_s to until_s. done: the request is answered.
  void worked(double from_s, double until_s, bool done);

 private:
  std::optional<wire::PlanRequest> question_;
  double rested_s_ = 0, next_s_ = 0;  // when deferrable work last could begin; when the next piece may
};

}  // namespace telesplat::packer
