import { MantineProvider } from "@mantine/core";
import { QueryClient, QueryClientProvider } from "@tanstack/react-query";
import { cleanup, render, screen } from "@testing-library/react";
import userEvent from "@testing-library/user-event";
import { afterEach, expect, it, vi } from "vitest";
import { api, ProblemError } from "../../lib/api/client";
import { SecondFactor } from "./SecondFactor";
import { ME } from "./testUsers";

const onChanged = vi.fn();

const show = (changes: Partial<typeof ME> = {}) =>
  render(
    <QueryClientProvider client={new QueryClient()}>
      <MantineProvider>
        <SecondFactor me={{ ...ME, second_factor: true, password: true, ...changes }} onChanged={onChanged} />
      </MantineProvider>
    </QueryClientProvider>,
  );

const removeButton = () => screen.getByRole("button", { name: /Remove the second factor/ });
const codeField = () => screen.getByRole("textbox", { name: /code/i });
const passwordField = () => screen.queryByLabelText("Your password again");

afterEach(() => {
  cleanup();
  vi.restoreAllMocks();
  onChanged.mockReset();
});

it("removes the second factor only with a password and a code", async () => {
  const remove = vi.spyOn(api, "removeSecondFactor").mockResolvedValue(undefined as never);
  show();
  await userEvent.click(removeButton());
  expect(removeButton()).toHaveProperty("disabled", true);
  await userEvent.type(passwordField() as HTMLElement, "long secret");
  expect(removeButton()).toHaveProperty("disabled", true);
  await userEvent.type(codeField(), "123456");
  await userEvent.click(removeButton());
  expect(remove.mock.calls).toEqual([["long secret", "123456"]]);
  expect(onChanged).toHaveBeenCalledOnce();
});

it("asks an account without a password for the code alone", async () => {
  const remove = vi.spyOn(api, "removeSecondFactor").mockResolvedValue(undefined as never);
  show({ password: false, openid: "Clinic login" });
  await userEvent.click(removeButton());
  expect(passwordField()).toBeNull();
  await userEvent.type(codeField(), "123456");
  await userEvent.click(removeButton());
  expect(remove.mock.calls).toEqual([[null, "123456"]]);
});

it("keeps the form and shows the problem of a refused code", async () => {
  const problem = { code: "wrong_code", detail: "The code is incorrect or was used before.", next_step: "" };
  vi.spyOn(api, "removeSecondFactor").mockRejectedValue(new ProblemError(problem as never));
  show();
  await userEvent.click(removeButton());
  await userEvent.type(passwordField() as HTMLElement, "long secret");
  await userEvent.type(codeField(), "000000");
  await userEvent.click(removeButton());
  expect((await screen.findByRole("alert")).textContent).toContain("The code is incorrect");
  expect(codeField()).toBeTruthy();
  expect(onChanged).not.toHaveBeenCalled();
});
