#include "peer.hpp"

#include <embree3/rtcore.h>

// User geometry with tight boxes, one point each, and a point query whose radius shrinks for k-NN.
class Embree {
public:
    static constexpr const char* name = "embree";
    static std::string version() { return RTC_VERSION_STRING; }

    explicit Embree(const std::vector<Point>& points) : points_(points) {
        device_ = rtcNewDevice("threads=1");
        scene_ = rtcNewScene(device_);
        RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_USER);
        rtcSetGeometryUserPrimitiveCount(geometry, unsigned(points.size()));
        rtcSetGeometryUserData(geometry, const_cast<Point*>(points.data()));
        rtcSetGeometryBoundsFunction(geometry, bounds, nullptr);
        rtcCommitGeometry(geometry);
        rtcAttachGeometry(scene_, geometry);
        rtcReleaseGeometry(geometry);
        rtcCommitScene(scene_);
        if (rtcGetDeviceError(device_) != RTC_ERROR_NONE) throw std::runtime_error("Embree: build");
    }
    Embree(const Embree&) = delete;
    ~Embree() {
        rtcReleaseScene(scene_);
        rtcReleaseDevice(device_);
    }

    template <class State>
    void search(const Point& query, float radius, State& state) const {
        RTCPointQueryContext context;
        rtcInitPointQueryContext(&context);
        RTCPointQuery ball{query.x, query.y, query.z, 0, radius};
        Search<State> search{points_.data(), query, state};
        rtcPointQuery(scene_, &ball, &context, visit<State>, &search);
    }

private:
    template <class State>
    struct Search {
        const Point* points;
        Point query;
        State& state;
    };

    static void bounds(const RTCBoundsFunctionArguments* args) {
        const Point& p = static_cast<const Point*>(args->geometryUserPtr)[args->primID];
        *args->bounds_o = {p.x, p.y, p.z, 0, p.x, p.y, p.z, 0};
    }

    template <class State>
    static bool visit(RTCPointQueryFunctionArguments* args) {
        auto& search = *static_cast<Search<State>*>(args->userPtr);
        float before = search.state.bound();
        float d2 = distance2(search.points[args->primID], search.query);
        if (d2 > before) return false;
        search.state.add(d2);
        if (search.state.bound() == before) return false;
        args->query->radius = std::sqrt(search.state.bound());
        return true;
    }

    const std::vector<Point>& points_;
    RTCDevice device_;
    RTCScene scene_;
};

int main(int argc, char** argv) { return run<Embree>(argc, argv); }
