/** The station's panels, loaded right after the first page. */
export { FirstSteps } from "./FirstSteps";
export { Loaded } from "./PlayPanel";
export { SimulatorPanel } from "./SimulatorPanel";
export { TeachPanel } from "./TeachPanel";
export { SessionWizard } from "./session-wizard/SessionWizard";
