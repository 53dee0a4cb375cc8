// The scene of a data server: one implementation per kind of scene. The serve loop (data_service.cpp) is the same for
// all kinds.
#pragma once

#include <fmt/format.h>

#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "common/core/result.h"
#include "common/net/socket.h"
#include "common/scene/kind.h"
#include "common/wire/messages.h"

namespace telesplat::data {

/// Sockets for answers. Answers may be dropped: the peer then asks again.
struct Outlets {
  net::Socket& requests;  ///< to the peers that asked, by Message::peer
  net::Socket& master;
};

/// An open data set. All calls come from the thread of the serve loop; none may block for long.
class Served {
 public:
  /// The socket for requests.
  struct Requests {
    std::string_view endpoint;  ///< its name among the session's endpoints: "chunks"; empty: no requests
    int high_water_mark = 0;    ///< answers queued per peer, at most
  };

  virtual ~Served() = default;
  virtual scene::Kind kind() const = 0;
  /// For users: a file's name, or another name of the scene. Any bytes.
  virtual std::string title() const = 0;
  /// For the log: the scene's size.
  virtual std::string summary() const = 0;
  /// For users: remarks on reading; lines that name the file.
  virtual std::vector<std::string> notes() const { return {}; }
  /// Adds facts, parameters and the box in the room to the hello.
  virtual void describe(wire::Hello& hello) const = 0;
  /// Returns its tables of session.toml, "\n[scene]\nkind = ..."; empty: file and flags say it all (record.h).
  virtual std::string record() const { return {}; }
  virtual Requests requests() const { return {}; }

  /// Called once, before the functions below. self: this data server.
  virtual void begin(InstanceId /*self*/) {}
  /// The session has changed. Error: it is not this scene's.
  virtual Status follow(const wire::Welcome& /*session*/) { return ok_status(); }
  /// Answers a request, now or later. An invalid message is rejected at its socket.
  virtual void answer(const net::Message& /*request*/, const Outlets& /*outlets*/) {}
  /// Carries out an order of the master. Returns its answer; nullopt: it comes over outlets.master. Error: why not.
  virtual Result<std::optional<std::string>> carry_out(const wire::Order& order) {
    return Error{fmt::format("a data server of {} does not know the order '{}'", scene::described(kind()),
                             order.command.substr(0, 64))};
  }
  /// Sends the answers that a thread of its own has finished meanwhile.
  virtual void send_finished(const Outlets& /*outlets*/) {}
  /// True once after describe() and notes() changed: then everyone is told anew.
  virtual bool take_changed() { return false; }
  /// Error: the data cannot be served any longer.
  virtual Status failure() const { return ok_status(); }
  /// Returns facts of the hello that have changed since the last call; they go to the master.
  virtual std::map<std::string, std::string> news() { return {}; }
  /// True while work goes on or answers wait without a message.
  virtual bool busy() const { return false; }
  virtual void add_status(std::map<std::string, double>& /*values*/) const {}
};

}  // namespace telesplat::data
