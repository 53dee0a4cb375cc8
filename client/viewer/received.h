// Content that a viewer receives from a session, keeps and draws: points of a model, frames of slice images, or
// pictures. There is one implementation for each pipeline (points/received_points.h, slices/received_slices.h,
// pictures/received_pictures.h), each with a cache of its own. No other code asks which one it is.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "client/viewer/coupling/coupling.h"
#include "client/viewer/coupling/view_requester.h"
#include "client/viewer/display/display_options.h"
#include "client/viewer/display/renderers.h"
#include "client/viewer/display/view_source.h"
#include "common/metrics/recorder.h"
#include "common/net/master_link.h"
#include "common/net/socket.h"
#include "common/scene/kind.h"

namespace telesplat::viewer {

/// A socket of this kind that connects to an endpoint of wire::Welcome, such as "state".
struct Feed {
  net::Kind kind;
  const char* endpoint;
};

/// Used by one thread.
class Feeds {
 public:
  /// viewer: its name, for logs.
  Feeds(net::Context& context, std::string viewer) : context_(context), viewer_(std::move(viewer)) {}

  /// Connects to the session's endpoints of these names. Returns true if it connected anew because an endpoint moved;
  /// old sockets are closed. While the session lacks one of the endpoints, all stays as it is.
  bool connect(std::span<const Feed> wanted, const wire::Welcome& session);
  void close() { open_.clear(); }

  bool connected() const { return !open_.empty(); }
  /// Null if it is not connected to that endpoint.
  net::Socket* find(std::string_view endpoint);
  /// Appends all sockets, for the caller to wait for.
  void add_to(std::vector<net::Socket*>& sockets);
  /// Number of messages on the open sockets that could not be used.
  uint64_t rejected() const;

 private:
  struct Open {
    std::string_view endpoint;
    std::string address;
    net::Socket socket;
  };
  net::Context& context_;
  std::string viewer_;
  std::vector<Open> open_;
};

class Received {
 public:
  virtual ~Received() = default;

  // ---- worker thread ----
  /// Takes the session as its master describes it now. Data that must be received anew close their feeds, so connect
  /// feeds after each call. Error: the session cannot be shown; names the value and its limit, and all stays as it was.
  virtual Status follow(const wire::Welcome& session) = 0;
  /// Feeds that bring updates.
  virtual std::span<const Feed> feeds() const = 0;
  /// The feeds were connected anew: to another packer, which knows nothing of this viewer.
  virtual void on_connected() = 0;
  /// Another master took over, which numbers frames anew.
  virtual void on_new_master() {}
  /// Takes at most `most` messages from each feed. Precondition: its feeds are connected.
  virtual void receive(int most) = 0;
  /// Does what is due by time alone. To be called every few milliseconds.
  virtual void tick(double now_s) = 0;
  /// All parts of an update for this viewer are here. Called only if the display waits for whole updates.
  virtual void on_complete(RequestId) {}
  /// An update for this viewer is complete. If the display waits for whole updates, it may show this one from now on,
  /// as all before it.
  virtual void on_update(const ShownUpdate&) {}
  /// The coupling has another number of buffers from now on; 0: the display waits for nothing. Complete updates that
  /// wait are then shown, the newest last. Call it after the gate's change if the display waits no more, else before.
  virtual void on_coupling(int buffers) = 0;
  /// Reports to the packer what was drawn since the last call.
  virtual void report() {}
  /// Another Received takes over: no function above is called any more. Content that is here can still be drawn.
  virtual void on_retired() {}
  /// Fills in the values that it knows; adds to "messages_rejected".
  virtual void add_status(net::MasterLink::Values& values) const = 0;

  // ---- display thread ----
  /// For displays in step with others (a wall) that do not wait for whole updates: the state that it could show by now.
  /// show_state() sets the state to show, or the nearest that it has; later content waits.
  virtual wire::ShownState newest_state() const = 0;
  virtual void show_state(const wire::ShownState& state) = 0;
  /// True if each picture is one frame sampled for one head, so that viewers in step ask for views of the same head.
  virtual bool shows_whole_frames() const { return false; }
  /// Makes the source that draws it; use it no longer than this lives. Error: no renderer could be made.
  virtual Result<std::unique_ptr<ViewSource>> make_source(const DisplayOptions& options, Renderers& renderers) = 0;
};

/// Objects that the worker lends. References and functions are used in the worker's thread, until the worker retires
/// the Received.
struct ReceivedLinks {
  InstanceId viewer;
  CouplingGate& gate;
  Feeds& feeds;
  metrics::SpanRecorder& spans;
  std::function<void(const ViewPart&)>
      on_part;  ///< a part of an update can be drawn, or is held until its update is complete
  std::function<void(RequestId)> on_lost;                       ///< its answer cannot be used: ask for it again
  std::function<void()> on_epoch;                               ///< a new epoch began
  std::function<std::optional<double>(RequestId)> requested_s;  ///< ViewRequester::requested_s()
  std::function<double(double)> to_master_s;
};

class EventRecorder;
class SliceRecorder;

struct ReceivedOptions {
  double epoch_patience_s = 0.15;  ///< EpochSwitch
  bool in_step = false;            ///< the display shows what show_state() says, as other viewers do
  EventRecorder* events =
      nullptr;  ///< keeps every applied event of points; null: nothing is kept. Outlives the Received
  SliceRecorder* slices = nullptr;  ///< the same of frames of slice images
};

std::shared_ptr<Received> make_received(scene::Pipeline pipeline, const ReceivedOptions& options,
                                        const ReceivedLinks& links);

}  // namespace telesplat::viewer
