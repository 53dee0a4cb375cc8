// What a viewer receives of a session, keeps and draws: points of a model, frames of slice images, or
// pictures. One implementation for each pipeline (points/received_points.h, slices/received_slices.h,
// pictures/received_pictures.h), each with a cache of its own.
// Nobody else asks which it is.
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

/// A socket of this kind to an endpoint of wire::Welcome, as "state".
struct Feed {
  net::Kind kind;
  const char* endpoint;
};

/// Used by one thread.
class Feeds {
 public:
  /// viewer: its name, for logs.
  Feeds(net::Context& context, std::string viewer) : context_(context), viewer_(std::move(viewer)) {}

  /// Connects to where the session says that these are. True: anew, because it is not where it was; what was open is
  /// closed. While the session does not know all of them everything stays as it is.
  bool connect(std::span<const Feed> wanted, const wire::Welcome& session);
  void close() { open_.clear(); }

  bool connected() const { return !open_.empty(); }
  /// Null if it is not connected.
  net::Socket* find(std::string_view endpoint);
  /// Adds all sockets, to wait for.
  void add_to(std::vector<net::Socket*>& sockets);
  /// Messages that could not be used, of the sockets that are open.
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
  /// The session as its master tells of it now. What must be received anew closes its feeds, which are to be connected
  /// after each call. Error: it cannot be shown; names the value and its limit. All stays as it was then.
  virtual Status follow(const wire::Welcome& session) = 0;
  /// Where updates come from.
  virtual std::span<const Feed> feeds() const = 0;
  /// Its feeds were connected anew: there is another packer, which knows nothing of this viewer.
  virtual void on_connected() = 0;
  /// Another master took over, which counts frames anew.
  virtual void on_new_master() {}
  /// Takes at most `most` messages from each feed. Its feeds are connected.
  virtual void receive(int most) = 0;
  /// What is due by time alone. To be called every few milliseconds.
  virtual void tick(double now_s) = 0;
  /// All parts of a view update of this viewer's are here. Only where the display waits for whole updates.
  virtual void on_complete(RequestId) {}
  /// A view update of this viewer's is complete. Where the display waits for whole updates: and may be displayed from
  /// now on, since all before it may.
  virtual void on_update(const ShownUpdate&) {}
  /// The coupling has other buffers from now on, 0: the display waits for nothing. What is complete and waits for the
  /// display is shown then, the newest last. To be called after the gate has changed, if that is so, else before it.
  virtual void on_coupling(int buffers) = 0;
  /// Tells the packer what was drawn since the last call.
  virtual void report() {}
  /// The session goes on with another one: nothing of the above is called any more. What is here can still be drawn.
  virtual void on_retired() {}
  /// Puts in what it knows better than the zeros that are there; adds to "messages_rejected".
  virtual void add_status(net::MasterLink::Values& values) const = 0;

  // ---- display thread ----
  /// Of a viewer that keeps in step with others (a wall), where it does not wait for whole updates: what it could show
  /// by now, and from now on shows, or the nearest that it has. What comes after it waits.
  virtual wire::ShownState newest_state() const = 0;
  virtual void show_state(const wire::ShownState& state) = 0;
  /// What it shows is one frame that was sampled for one head, so that viewers in step ask for views of the same head.
  virtual bool shows_whole_frames() const { return false; }
  /// What draws it, to be used no longer than this lives. Error: no renderer could be made.
  virtual Result<std::unique_ptr<ViewSource>> make_source(const DisplayOptions& options, Renderers& renderers) = 0;
};

/// What the worker lends. References and functions are used in the worker's thread, as long as it has not retired the
/// Received.
struct ReceivedLinks {
  InstanceId viewer;
  CouplingGate& gate;
  Feeds& feeds;
  metrics::SpanRecorder& spans;
  std::function<void(const ViewPart&)>
      on_part;                             ///< part of an update can be drawn, or is held until its update is complete
  std::function<void(RequestId)> on_lost;  ///< its answer cannot be used: it is to be asked for again
  std::function<void()> on_epoch;          ///< a new epoch began
  std::function<std::optional<double>(RequestId)> requested_s;  ///< ViewRequester
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
