#include "services/sampler/drain_guard.h"

#include <chrono>
#include <cstdlib>
#include <utility>

#include "common/core/guarded.h"
#include "common/net/service.h"
#include "common/net/socket.h"

namespace telesplat::sampler {
namespace {
constexpr std::chrono::duration<double> kLook{0.2};  // how late a stop is noticed
}

DrainGuard::DrainGuard(const std::string& master, InstanceId instance, net::Access access)
    : thread_([this, master, instance, access = std::move(access)] { watch(master, instance, access); }) {}

DrainGuard::~DrainGuard() {
  {
    const std::lock_guard lock(mutex_);
    done_ = true;
  }
  wake_.notify_all();
  thread_.join();
}

void DrainGuard::watch(const std::string& master, InstanceId instance, const net::Access& access) {
  std::unique_lock lock(mutex_);
  const auto done = [this] { return done_; };
  while (!net::stop_requested())
    if (wake_.wait_for(lock, kLook, done)) return;
  if (wake_.wait_for(lock, std::chrono::duration<double>(kStop_s), done)) return;
  log::warn("told to stop, and a lease takes too long: it is given up");
  const Status told = guarded("saying goodbye", [&] {
    // The service's own socket belongs to the thread that is busy.
    net::Context context(access);
    net::Socket socket(context, net::Kind::kDealer, "goodbye");
    if (socket.connect(master)) socket.send(wire::Goodbye{instance});
  });
  std::_Exit(told ? 0 : 1);
}

}  // namespace telesplat::sampler
