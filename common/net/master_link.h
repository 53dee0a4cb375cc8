// The client side of the master, the same for data, sampler, packer, viewer and ctl: hello until welcomed, a status
// report a second, hello again when the master asks, what the master's clock says, shutdown. While its owner works and
// does not tick, the thread that reads the socket says that the process lives.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "common/net/clock_estimate.h"
#include "common/net/socket.h"

namespace telesplat::net {

class MasterLink {
 public:
  using Values = std::map<std::string, double>;
  /// An owner that does not tick for longer hangs: it is not said to live any more.
  static constexpr double kLongestWork_s = 60;

  /// Connects to the master at `endpoint`; instance, pid and process_facts() are filled in. Nothing is sent before the
  /// first tick().
  MasterLink(Context& context, const std::string& endpoint, wire::Hello hello);

  Socket& socket() { return socket_; }
  InstanceId instance() const { return hello_.instance; }

  /// To be called at least every 100 ms: says hello until welcomed (every 250 ms), then reports status (every second)
  /// and asks what the master's clock says; `status` is asked for its values then.
  void tick(double now_s, const std::function<Values()>& status);

  /// Handles welcome, who_are_you, clock_reply and shutdown, rejects other unknown types unless the caller knows them:
  /// returns true if the message was one of these.
  bool handle(const Message& message);

  /// Handles all messages that are here by now; those that handle() does not know are rejected.
  void receive();

  /// What orders of others come to (wire::Order). Without one they are refused.
  using Obey = std::function<void(const wire::Order&)>;
  void on_order(Obey obey) { obey_ = std::move(obey); }
  /// The answer to an order of this master's.
  void answer(uint64_t number, bool ok, std::string text);

  /// The newest session, once there is one; version() rises with each.
  const std::optional<wire::Welcome>& session() const { return session_; }
  int version() const { return version_; }
  /// The session is over for this process: its end was told, or the master does not let it in.
  bool shutdown_requested() const { return shutdown_; }
  /// What the master says why the session ends; empty: it has said nothing.
  const std::string& shutdown_reason() const { return shutdown_reason_; }
  /// The master does not let it in with its keys (why was logged): bad usage, exit code 2.
  bool refused() const { return refused_; }
  /// This machine's monotonic time on the master's clock.
  double to_master_s(double local_s) const { return local_s + clock_.offset_s(local_s); }
  const ClockEstimate& clock() const { return clock_; }

  /// Sets a fact that was not known at first; the master is told by another hello.
  void tell(const std::string& fact, const std::string& value);

  /// Last report and goodbye.
  void leave(const std::function<Values()>& status);

 private:
  void report(const std::function<Values()>& status, double now_s);
  void ask_clock(double now_s);
  void look_for_refusal();
  void learn_clock(const wire::ClockReply& reply, double arrived_s);
  void follow_welcomed(bool welcomed);

  struct Life;
  wire::Hello hello_;
  std::shared_ptr<Life> life_;  // shared with the socket's thread
  Socket socket_;
  std::optional<wire::Welcome> session_;
  int version_ = 0;
  std::string shutdown_reason_;
  bool shutdown_ = false, welcomed_ = false, refused_ = false, warned_ = false;
  Obey obey_;
  ClockEstimate clock_;
  int clock_asked_ = 0;  // since the master is known
  const std::string endpoint_;
  double last_hello_s_ = -1e9, last_status_s_ = -1e9, last_clock_s_ = -1e9;
};

}  // namespace telesplat::net
