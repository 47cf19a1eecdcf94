/** What is worked with at the station: no part of the first page, but fetched right behind it. */
export { FirstSteps } from "./FirstSteps";
export { Loaded } from "./PlayPanel";
export { SimulatorPanel } from "./SimulatorPanel";
export { TeachPanel } from "./TeachPanel";
export { SessionWizard } from "./visit/SessionWizard";
