// Tells the new life of a process from a second process of the same name: the old life does not speak again. No
// sockets, no clocks.
#pragma once

#include <map>

#include "common/core/ids.h"

namespace telesplat::master {

class Namesakes {
 public:
  static constexpr double kMemory_s = 10;       ///< who was replaced speaks again within a second, if it lives
  static constexpr size_t kMostKept = 1 << 12;  ///< beyond, the one that was replaced first is forgotten

  /// Another process of its role and name took this one's place.
  void replaced(InstanceId instance, double now_s);
  /// This process says hello. True: it was replaced a moment ago, and yet it lives. Told once for each time.
  bool lives_on(InstanceId instance, double now_s);

 private:
  std::map<InstanceId, double> replaced_;  // when
};

}  // namespace telesplat::master
