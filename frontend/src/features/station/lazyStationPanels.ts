/** The station's panels. They are loaded right after the first page. */
export { CommissioningState } from "../commissioning/CommissioningState";
export { DriveHealth } from "./DriveHealth";
export { FirstSteps } from "./FirstSteps";
export { LoadedRun } from "./LoadedRun";
export { SimulatorPanel } from "./SimulatorPanel";
export { SessionWizard } from "./session-wizard/SessionWizard";
export { TeachPanel } from "./TeachPanel";
