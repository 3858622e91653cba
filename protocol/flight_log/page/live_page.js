// The page of a live flight: what the station tells goes to the view.
const live = flightView(document.getElementById("view")), words = document.getElementById("status");
window.shownFlight = live;
if (live) {
  const told = new EventSource("flight");
  let vehicle = "";
  told.onmessage = ({ data }) => {
    const state = JSON.parse(data);
    words.textContent = state.status;
    if (state.time === null || state.place === null) return;
    if (String(state.vehicle) !== vehicle) live.times = []; // another vehicle is shown: begin anew
    vehicle = String(state.vehicle);
    live.append(state);
  };
  told.onerror = () => { words.textContent = "The ground station has ended, or does not answer"; };
}
