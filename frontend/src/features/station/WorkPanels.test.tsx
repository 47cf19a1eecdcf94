import { MantineProvider } from "@mantine/core";
import { QueryClient, QueryClientProvider } from "@tanstack/react-query";
import { cleanup, fireEvent, render, screen } from "@testing-library/react";
import { afterEach, describe, expect, it, vi } from "vitest";
import { api, type Live, type Recording } from "../../lib/api/client";
import { type LiveState, store } from "../../lib/live/store";
import { WorkPanels } from "./WorkPanels";

vi.mock("./TeachPanel", () => ({ TeachPanel: () => <div>teaching</div> }));
vi.mock("./session-wizard/SessionWizard", () => ({ SessionWizard: () => <div>session</div> }));
const recordings = vi.spyOn(api, "recordings");

function show(owned: number, live: Partial<Live> = {}) {
  const state = { connected: true, heardAt: 0, station: null, live, events: [] };
  vi.spyOn(store, "get").mockReturnValue(state as unknown as LiveState);
  recordings.mockResolvedValue({ items: Array<Recording>(owned).fill({} as Recording) });
  const queries = new QueryClient();
  render(
    <MantineProvider env="test">
      <QueryClientProvider client={queries}>
        <WorkPanels patientId="p" wanted={null} />
      </QueryClientProvider>
    </MantineProvider>,
  );
  return queries;
}
const seen = () =>
  ["teaching", "session"].filter((panel) => screen.queryByText(panel)?.closest("[hidden]") === null);

afterEach(cleanup);

describe("what to do at the station", () => {
  it("is teaching for a patient without a recording, else the session", async () => {
    show(0);
    await vi.waitFor(() => expect(seen()).toEqual(["teaching"]));
    cleanup();
    show(2);
    await vi.waitFor(() => expect(recordings).toHaveBeenCalled());
    expect(seen()).toEqual(["session"]);
  });

  it("does not change under the hand when the first recording is saved", async () => {
    const queries = show(0);
    await vi.waitFor(() => expect(seen()).toEqual(["teaching"]));
    recordings.mockResolvedValue({ items: [{} as Recording] });
    await queries.invalidateQueries({ queryKey: ["recordings"] });
    expect(seen()).toEqual(["teaching"]);
    fireEvent.click(screen.getByRole("radio", { name: "Session" }));
    expect(seen()).toEqual(["session"]);
  });

  it("is what the apparatus is doing, without a choice", () => {
    show(2, { teaching: {} as Live["teaching"] });
    expect([screen.queryByText("session"), screen.queryByRole("radio")]).toEqual([null, null]);
    cleanup();
    show(0, { run: {} as Live["run"] });
    expect(screen.queryByText("teaching")).toBeNull();
    expect(seen()).toContain("session");
  });
});
