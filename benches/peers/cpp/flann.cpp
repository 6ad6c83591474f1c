#include "peer.hpp"

#include <flann/flann.hpp>

// A result set of our own: nothing is stored, as everywhere here.
template <class State>
struct Results final : flann::ResultSet<float> {
    State& state;
    explicit Results(State& s) : state(s) {}
    bool full() const override { return true; }
    void addPoint(float d2, size_t) override {
        if (d2 <= state.bound()) state.add(d2);
    }
    float worstDist() const override {
        return std::nextafterf(state.bound(), std::numeric_limits<float>::infinity());
    }
};

class Flann {
public:
    static constexpr const char* name = "flann";
    static std::string version() { return FLANN_VERSION_; }

    explicit Flann(const std::vector<Point>& points)
        : index_(flann::Matrix<float>(const_cast<float*>(&points[0].x), points.size(), 3),
                 flann::KDTreeSingleIndexParams(10)) {
        index_.buildIndex();
    }

    template <class State>
    void search(const Point& query, float, State& state) const {
        Results<State> results(state);
        index_.findNeighbors(results, &query.x, flann::SearchParams());
    }

private:
    flann::KDTreeSingleIndex<flann::L2_Simple<float>> index_;
};

int main(int argc, char** argv) { return run<Flann>(argc, argv); }
