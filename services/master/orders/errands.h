// Orders of people that another process carries out: a viewer or a data server. The master passes them on, and their
// answers back. No sockets, no clocks.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/core/result.h"
#include "common/wire/messages.h"

namespace telesplat::master {

class Errands {
 public:
  static constexpr double kPatience_s = 3;  ///< for an answer
  static constexpr size_t kMost = 256;      ///< under way; more are refused

  struct Reply {
    std::string peer;  ///< who asked
    wire::ControlReply reply;
  };

  /// An order that `asked` processes have been sent, under this number; the first answer that is good counts, and if
  /// none is the last one. Error: too many are under way.
  Result<uint64_t> begin(const std::string& peer, size_t asked, double now_s);
  /// Nothing: others may still answer, or nobody waits for it any more.
  std::optional<Reply> answered(const wire::OrderAnswer& answer);
  /// Those that nobody answered in time.
  std::vector<Reply> overdue(double now_s);

 private:
  struct Errand {
    std::string peer;
    size_t open = 1;
    double until_s = 0;
  };
  uint64_t last_ = 0;
  std::map<uint64_t, Errand> errands_;
};

/// Who carries out an order of `telesplat ctl`: "viewer" or "data"; empty: it is none that the master passes on.
std::string errand_for(const std::string& command);

}  // namespace telesplat::master
