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
#include "common/net/connections/waiting.h"
#include "common/net/socket.h"

namespace telesplat::net {

class MasterLink {
 public:
  using Values = std::map<std::string, double>;
  /// An owner that does not tick for longer hangs: it is not said to live any more.
  static constexpr double kLongestWork_s = 60;

  /// Connects to the master at `endpoint`; instance, pid and process_facts() are filled in. Nothing is sent before the
  /// first tick().
  /// give_up_after_s: how long it waits for the master, or for what the session lacks; 0: for ever.
  MasterLink(Context& context, const std::string& endpoint, wire::Hello hello, double give_up_after_s = 0);

  Socket& socket() { return socket_; }
  InstanceId instance() const { return hello_.instance; }

  /// To be called at least every 100 ms: says hello until welcomed (every 250 ms), then reports status (every second)
  /// and asks what the master's clock says; `status` is asked for its values then. Logs what is waited for.
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

  /// Called when this process becomes another instance, because the master knows the one before as another's. Without
  /// it, and after some in a row, the process is refused.
  using Renewed = std::function<void(InstanceId)>;
  void on_renewed(Renewed renewed) { renewed_ = std::move(renewed); }

  /// The newest session, once there is one; version() rises with each.
  const std::optional<wire::Welcome>& session() const { return session_; }
  int version() const { return version_; }
  /// The session is over for this process: its end was told, the master does not let it in, or it waited too long.
  bool shutdown_requested() const { return shutdown_; }
  /// What the master says why the session ends; empty: it has said nothing.
  const std::string& shutdown_reason() const { return shutdown_reason_; }
  /// The master does not take it in (why was logged): bad usage.
  bool refused() const { return refused_; }
  /// What the process ends with, as far as the master goes: 2 if it is refused, 1 if it waited too long, else 0.
  int exit_code() const { return refused_ ? 2 : gave_up_ ? 1 : 0; }
  /// This machine's monotonic time on the master's clock.
  double to_master_s(double local_s) const { return local_s + clock_.offset_s(local_s); }
  const ClockEstimate& clock() const { return clock_; }

  /// Sets a fact that was not known at first; the master is told by another hello.
  void tell(const std::string& fact, const std::string& value);

  /// Last report and goodbye.
  void leave(const std::function<Values()>& status);

 private:
  void report(const std::function<Values()>& status, double now_s);
  void say_hello(double sent_s);
  bool renew();
  void ask_clock(double now_s);
  void look_for_refusal();
  std::string awaited();
  void look_at_waiting(double now_s);
  void learn_clock(const wire::ClockReply& reply, double arrived_s);
  void follow_welcomed(bool welcomed);

  struct Life;
  wire::Hello hello_;
  std::shared_ptr<Life> life_;  // shared with the socket's thread
  Socket socket_;
  std::optional<wire::Welcome> session_;
  int version_ = 0;
  bool shutdown_ = false, welcomed_ = false, refused_ = false, warned_ = false, gave_up_ = false;
  std::string shutdown_reason_;
  Obey obey_;
  Renewed renewed_;
  int hellos_ = 0;         // of this instance, since it was welcomed
  int hellos_before_ = 0;  // of the instance before: they will be refused, too
  int renewals_ = 0;       // since it was welcomed
  ClockEstimate clock_;
  int clock_asked_ = 0;  // since the master is known
  const std::string endpoint_;
  const double give_up_after_s_;
  Waiting waiting_;
  HostSearch host_;
  double ticked_s_ = -1e9, silent_s_ = 0;  // since the master was heard, as far as this process ran
  double last_hello_s_ = -1e9, last_status_s_ = -1e9, last_clock_s_ = -1e9;
};

}  // namespace telesplat::net
