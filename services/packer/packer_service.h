// The packer process (T4.3): takes what samplers send and gives viewers what they do not have yet.
#pragma once

#include <memory>
#include <optional>

#include "common/net/turns.h"
#include "common/wire/tile_messages.h"
#include "services/packer/packer_options.h"

namespace telesplat::packer {

class PackerService : public net::Turns {
 public:
  /// Binds its sockets. Error: that cannot be done, or what it shall record to cannot be written. Context and options
  /// must outlive it.
  static Result<std::unique_ptr<PackerService>> open(net::Context& context, const PackerOptions& options);
  virtual int exit_code() const = 0;
};

/// Serves until told to stop. Exit code 0, or 2 if it cannot bind.
Result<int> run(const PackerOptions& options);

/// What the packer does when nobody waits for it: the question about rays beyond views. No sockets, no clocks.
class SpareTime {
 public:
  /// What can wait does so while a view is under way, but no longer than this: where many viewers look, one always is.
  static constexpr double kLongestHurry_s = 0.25;
  /// Where views come as fast as they are answered, questions beyond them take a quarter of the time at most.
  static constexpr double kPause = 3;

  /// Whether a piece of work that can wait may begin. hurried: a view is under way.
  bool begins(double now_s, bool hurried);

  /// A question about rays beyond a view. The master waits for one at a time: an older one is no longer waited for.
  void keep(const wire::PlanRequest& extra) { question_ = extra; }
  /// A viewer's next view is planned: the question about its views is about this one from now on.
  void follow(const wire::PlanRequest& view);
  /// Null: there is none, or it waits. A head that rests does not wait for views.
  const wire::PlanRequest* question(double now_s) const;
  /// A piece of the work for question() was done. done: it has its answer.
  void worked(double from_s, double until_s, bool done);

 private:
  std::optional<wire::PlanRequest> question_;
  double rested_s_ = 0, next_s_ = 0;  // when there last was time; when the next piece for the question may begin
};

}  // namespace telesplat::packer
