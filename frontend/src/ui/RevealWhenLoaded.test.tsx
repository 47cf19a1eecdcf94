import { MantineProvider } from "@mantine/core";
import { QueryClient, QueryClientProvider, useQuery } from "@tanstack/react-query";
import { act, cleanup, render, screen } from "@testing-library/react";
import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { RevealWhenLoaded } from "./RevealWhenLoaded";

beforeEach(() => void vi.useFakeTimers());
afterEach(() => {
  cleanup();
  vi.useRealTimers();
});

/** What is asked is answered when the test says so. */
function asking() {
  const answers: Record<string, { give: (text: string) => void; refuse: (why: Error) => void }> = {};
  const ask = (name: string) =>
    new Promise<string>((give, refuse) => {
      answers[name] = { give, refuse };
    });
  const answer = async (name: string, text: string | Error) => {
    if (text instanceof Error) answers[name]?.refuse(text);
    else answers[name]?.give(text);
    await passed(10);
  };
  return { ask, answer };
}

const passed = (ms: number) => act(() => vi.advanceTimersByTimeAsync(ms));

function Part(props: {
  name: string;
  ask: (name: string) => Promise<string>;
  late?: boolean;
  then?: string;
}) {
  const { name, ask, late = false, then } = props;
  const part = useQuery({ queryKey: [name], queryFn: () => ask(name), meta: { late } });
  return (
    <>
      <p>{part.data ?? ""}</p>
      {part.data && then && <Part name={then} ask={ask} />}
    </>
  );
}

function drawn(children: React.ReactNode, props: { waits?: boolean; now?: boolean } = {}) {
  const queries = new QueryClient({ defaultOptions: { queries: { retry: 1 } } });
  const page = (given: typeof props) => (
    <MantineProvider env="test">
      <QueryClientProvider client={queries}>
        <RevealWhenLoaded {...given}>
          <h1>Page</h1>
          {children}
        </RevealWhenLoaded>
      </QueryClientProvider>
    </MantineProvider>
  );
  const { rerender } = render(page(props));
  return (given: typeof props) => rerender(page(given));
}

const shown = () => screen.queryByRole("heading") !== null;

describe("a page in one piece", () => {
  it("is shown when each of its parts is there, also what only the answer to another asks for", async () => {
    const { ask, answer } = asking();
    drawn([<Part key="a" name="a" ask={ask} then="c" />, <Part key="b" name="b" ask={ask} />]);
    await passed(10);
    expect(shown()).toBe(false);
    await answer("b", "B");
    await answer("a", "A");
    expect(shown()).toBe(false);
    await answer("c", "C");
    expect(shown()).toBe(true);
  });

  it("does not wait for what is late, nor again for what was refused", async () => {
    const { ask, answer } = asking();
    drawn([<Part key="a" name="a" ask={ask} late />, <Part key="b" name="b" ask={ask} />]);
    await passed(10);
    expect(shown()).toBe(false);
    await answer("b", new Error("the database is away"));
    expect(shown()).toBe(true);
  });

  it("waits for nothing longer than five seconds", async () => {
    const { ask } = asking();
    drawn(<Part name="a" ask={ask} />);
    await passed(4_900);
    expect(shown()).toBe(false);
    await passed(200);
    expect(shown()).toBe(true);
  });

  it("is shown at once where somebody needs it now, and stays", async () => {
    const { ask } = asking();
    const again = drawn(<Part name="a" ask={ask} />, { now: true });
    expect(shown()).toBe(true);
    again({ now: false });
    expect(shown()).toBe(true);
  });

  it("waits for what else it is told to", async () => {
    const again = drawn(null, { waits: true });
    await passed(10);
    expect(shown()).toBe(false);
    again({ waits: false });
    await passed(10);
    expect(shown()).toBe(true);
  });
});
