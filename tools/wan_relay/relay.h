// Passes bytes between the clients that connect here and the places they connect to, through a simulated link.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "tools/wan_relay/options.h"

namespace telesplat::wan_relay {

class Relay {
 public:
  /// Listens at all doors; refers to the options. Error: names the door and the reason.
  static Result<std::unique_ptr<Relay>> open(const Options& options);
  ~Relay();

  /// Addresses of the doors: ADDRESS:PORT.
  std::vector<std::string> addresses() const;
  /// Passes bytes on until SIGINT or SIGTERM; on SIGUSR1 `tell` gets the statistics.
  void run(const std::function<void(const std::string&)>& tell);
  /// Returns counts of connections and bytes, in one line.
  std::string statistics() const;

 private:
  struct Impl;
  explicit Relay(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace telesplat::wan_relay
