import { MantineProvider } from "@mantine/core";
import { QueryClient, QueryClientProvider, useQuery } from "@tanstack/react-query";
import { act, cleanup, render, screen } from "@testing-library/react";
import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { RevealWhenLoaded, useRevealed } from "./RevealWhenLoaded";

beforeEach(() => void vi.useFakeTimers());
afterEach(() => {
  cleanup();
  vi.useRealTimers();
});

/** Queries whose answers the test controls. */
function controlledQueries() {
  const answers: Record<string, { give: (text: string) => void; refuse: (why: Error) => void }> = {};
  const ask = (name: string) =>
    new Promise<string>((give, refuse) => {
      answers[name] = { give, refuse };
    });
  const answer = async (name: string, text: string | Error) => {
    if (text instanceof Error) answers[name]?.refuse(text);
    else answers[name]?.give(text);
    await advance(10);
  };
  return { ask, answer };
}

const advance = (ms: number) => act(() => vi.advanceTimersByTimeAsync(ms));

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

function show(
  children: React.ReactNode,
  props: { waits?: boolean; now?: boolean; onIdle?: () => void } = {},
) {
  const queries = new QueryClient({ defaultOptions: { queries: { retry: 1 } } });
  const page = (current: typeof props) => (
    <MantineProvider env="test">
      <QueryClientProvider client={queries}>
        <RevealWhenLoaded {...current}>
          <h1>Page</h1>
          {children}
        </RevealWhenLoaded>
      </QueryClientProvider>
    </MantineProvider>
  );
  const { rerender } = render(page(props));
  return (current: typeof props) => rerender(page(current));
}

const isShown = () => screen.queryByRole("heading") !== null;

describe("a page that loads as a whole", () => {
  it("appears when all parts and their dependent parts loaded", async () => {
    const { ask, answer } = controlledQueries();
    show([<Part key="a" name="a" ask={ask} then="c" />, <Part key="b" name="b" ask={ask} />]);
    await advance(10);
    expect(isShown()).toBe(false);
    await answer("b", "B");
    await answer("a", "A");
    expect(isShown()).toBe(false);
    await answer("c", "C");
    expect(isShown()).toBe(true);
  });

  it("waits neither for late parts nor for retries", async () => {
    const { ask, answer } = controlledQueries();
    show([<Part key="a" name="a" ask={ask} late />, <Part key="b" name="b" ask={ask} />]);
    await advance(10);
    expect(isShown()).toBe(false);
    await answer("b", new Error("the database is away"));
    expect(isShown()).toBe(true);
  });

  it("waits at most five seconds", async () => {
    const { ask } = controlledQueries();
    show(<Part name="a" ask={ask} />);
    await advance(4_900);
    expect(isShown()).toBe(false);
    await advance(200);
    expect(isShown()).toBe(true);
  });

  it("appears at once on demand and stays", async () => {
    const { ask } = controlledQueries();
    const update = show(<Part name="a" ask={ask} />, { now: true });
    expect(isShown()).toBe(true);
    update({ now: false });
    expect(isShown()).toBe(true);
  });

  it("starts further work once, after it appeared", async () => {
    const { ask, answer } = controlledQueries();
    const [onIdle, again] = [vi.fn(), vi.fn()];
    const Further = () => <output>{String(useRevealed())}</output>;
    const update = show([<Part key="a" name="a" ask={ask} />, <Further key="b" />], { onIdle });
    await advance(100);
    expect(onIdle).not.toHaveBeenCalled();
    expect(screen.getByText("false")).toBeDefined();
    await answer("a", "A");
    expect(screen.getByText("true")).toBeDefined();
    await advance(10);
    expect(onIdle).toHaveBeenCalledTimes(1);
    update({ onIdle: again });
    await advance(100);
    expect(onIdle).toHaveBeenCalledTimes(1);
    expect(again).not.toHaveBeenCalled();
  });

  it("waits for an additional condition", async () => {
    const update = show(null, { waits: true });
    await advance(10);
    expect(isShown()).toBe(false);
    update({ waits: false });
    await advance(10);
    expect(isShown()).toBe(true);
  });
});
