#include "peer.hpp"

#include <nanoflann.hpp>

struct Cloud {
    const std::vector<Point>& points;
    size_t kdtree_get_point_count() const { return points.size(); }
    float kdtree_get_pt(size_t i, size_t axis) const { return (&points[i].x)[axis]; }
    template <class Box>
    bool kdtree_get_bbox(Box&) const {
        return false;
    }
};

using Tree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<float, Cloud>, Cloud, 3, uint32_t>;

// Its own result sets take points nearer than the bound, ours those at it too.
template <class State>
struct Results {
    using DistanceType = float;
    using IndexType = uint32_t;
    State& state;
    bool addPoint(float d2, uint32_t) {
        state.add(d2);
        return true;
    }
    float worstDist() const { return std::nextafterf(state.bound(), std::numeric_limits<float>::infinity()); }
    bool full() const { return true; }
    bool empty() const { return false; }
    size_t size() const { return state.result().n; }
    void sort() {}
};

class Nanoflann {
public:
    static constexpr const char* name = "nanoflann";
    static std::string version() {
        char text[16];
        std::snprintf(text, sizeof text, "%x.%x.%x", NANOFLANN_VERSION >> 8, NANOFLANN_VERSION >> 4 & 15,
                      NANOFLANN_VERSION & 15);
        return text;
    }

    explicit Nanoflann(const std::vector<Point>& points)
        : cloud_{points}, tree_(3, cloud_, nanoflann::KDTreeSingleIndexAdaptorParams(10)) {}

    template <class State>
    void search(const Point& query, float, State& state) const {
        Results<State> results{state};
        tree_.findNeighbors(results, &query.x, {});
    }

private:
    Cloud cloud_;
    Tree tree_;
};

int main(int argc, char** argv) { return run<Nanoflann>(argc, argv); }
