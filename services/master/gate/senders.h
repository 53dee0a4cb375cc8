// What a sender may say, beyond what the table of roles tells by a message's name alone: who it says it is, in whose
// name it speaks, and which commands it gives.
#pragma once

#include <list>
#include <map>
#include <string>
#include <unordered_map>

#include "common/core/result.h"
#include "common/net/socket.h"
#include "common/wire/messages.h"

namespace telesplat::master {

class Senders {
 public:
  /// Processes that are remembered. Of more, the first one of the key that has the most is forgotten, so that no key's
  /// owner can make this forget another's.
  static constexpr size_t kMost = 8192;

  /// Errors are the sender's fault; the message must not reach the core then. A sender who is not known, and does not
  /// speak for a process of another key, is let pass: the core asks who it is.
  Status admit(const net::Message& from, const wire::Hello& m);
  Status admit(const net::Message& from, const wire::Goodbye& m);
  Status admit(const net::Message& from, const wire::SwapReady& m);
  Status admit(const net::Message& from, const wire::Control& m);
  template <class M>
  Status admit(const net::Message& from, const M& m) {
    if constexpr (requires { m.instance; })
      return speaks_for(from, m.instance);
    else if constexpr (requires { m.data; })
      return speaks_for(from, m.data);
    else if constexpr (is_request<M>)
      return speaks_for(from, claimed(m));
    else
      return ok_status();
  }

 private:
  // Messages of a viewer or sampler that name their sender; in others these fields mean somebody else.
  template <class M>
  static constexpr bool is_request = std::is_same_v<M, wire::ViewRequest> || std::is_same_v<M, wire::LeaseRequest> ||
                                     std::is_same_v<M, wire::LeaseExtend> || std::is_same_v<M, wire::SlabReady>;
  static InstanceId claimed(const wire::ViewRequest& m) { return m.viewer; }
  static InstanceId claimed(const auto& m) { return m.sampler; }

  Status speaks_for(const net::Message& from, InstanceId instance) const;
  Status is_same_user(const net::Message& from, InstanceId instance) const;

  struct Owner {
    std::string peer;                       ///< routing id of the connection that said hello
    std::string user;                       ///< the name of its key; empty: there are no keys
    std::list<InstanceId>::iterator place;  ///< in of_user_
  };
  void forget(InstanceId instance);

  std::unordered_map<InstanceId, Owner> owners_;
  std::unordered_map<std::string, InstanceId> instances_;  // by routing id
  std::map<std::string, std::list<InstanceId>> of_user_;   // owners_, the first hello first
};

}  // namespace telesplat::master
